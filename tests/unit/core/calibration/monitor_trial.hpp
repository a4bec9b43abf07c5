#pragma once
#include <functional>
#include <memory>
#include <numbers>
#include <optional>

#include "core/calibration/detail/monitor_residuals.hpp"
#include "tests/support/feature_drive.hpp"

namespace vergence::test {

inline constexpr double kRadian = 180.0 / std::numbers::pi;

/// A feature drive watched by a Monitor as the estimator would run one: matches are those within
/// `gate_px` of the epipolar line of the calibration in use.
class MonitorTrial {
 public:
  /// The reference is the true transform, exactly.
  explicit MonitorTrial(const FeatureDriveOptions& drive,
                        const calibration::MonitorOptions& options = {})
      : MonitorTrial(drive, drive.T_right_left, Mat6::Zero(), options) {}
  MonitorTrial(const FeatureDriveOptions& drive, const Transform& T_right_left,
               const Mat6& covariance, const calibration::MonitorOptions& options = {})
      : arena_(std::make_unique<Arena>()),
        drive_(drive),
        monitor_(options, *arena_),
        epipolar_(T_right_left) {
    (void)monitor_.set_reference({T_right_left, drive.left, drive.right}, covariance);
  }

  /// The next frame.
  const calibration::MonitorResult& step() {
    drive_.next();
    return show(drive_);
  }

  /// A frame of some drive.
  const calibration::MonitorResult& show(const FeatureDrive& drive) {
    observations_.clear();
    const Pinhole &l = drive.options().left, &r = drive.options().right;
    for (const FeatureTrack& t : drive.tracks()) {
      double off = 0;
      const Vec2 left((t.left.x() - l.cx) / l.fx, (t.left.y() - l.cy) / l.fy),
          right((t.right.x() - r.cx) / r.fx, (t.right.y() - r.cy) / r.fy);
      if (!epipolar_.to_line(left, right, &off, nullptr)) continue;
      if (std::abs(off) * r.fy < gate_px)
        observations_.push_back({t.left, t.right, t.sigma_px, t.id});
    }
    frame_.found_stereo = static_cast<int>(observations_.size());
    frame_.expected_stereo = static_cast<int>(drive.tracks().size());
    if (spoil) spoil(observations_);
    frame_.frame = drive.frame();
    // A centimetre between two images at 30 Hz.
    frame_.moving = drive.T_now_previous().t.norm() > 0.01;
    frame_.stereo = observations_;
    verdict_ = monitor_.update(frame_);
    return verdict_;
  }

  /// Frames until the verdict is `requested` or, without one, anything but quiet; nothing within
  /// `limit` frames.
  [[nodiscard]] std::optional<int> frames_until(
      int limit, std::optional<calibration::MonitorResult::Kind> requested = {}) {
    for (int i = 1; i <= limit; ++i) {
      const auto kind = step().kind;
      if (requested ? kind == *requested : kind != calibration::MonitorResult::Kind::quiet)
        return i;
    }
    return {};
  }

  [[nodiscard]] const calibration::MonitorResult& verdict() const { return verdict_; }
  [[nodiscard]] const calibration::MonitorFrame& frame() const { return frame_; }
  [[nodiscard]] const FeatureDrive& drive() const { return drive_; }
  [[nodiscard]] calibration::Monitor& monitor() { return monitor_; }

  double gate_px = 20;
  // Changes the matches of a frame before the monitor sees them.
  std::function<void(std::vector<calibration::StereoObservation>&)> spoil;

 private:
  std::unique_ptr<Arena> arena_;
  FeatureDrive drive_;
  calibration::Monitor monitor_;
  EpipolarGeometry epipolar_;
  std::vector<calibration::StereoObservation> observations_;
  calibration::MonitorFrame frame_;
  calibration::MonitorResult verdict_;
};

/// A calibration as a drive of two seconds through another street finds it: off by its error, with
/// its covariance.
struct TrialReference {
  Transform T_right_left;
  Mat6 covariance;
};
[[nodiscard]] inline TrialReference calibrated(FeatureDriveOptions drive) {
  drive.changes.clear();
  drive.drive_s = drive.stop_s = 0;
  drive.seed += 1000;
  const Transform& T = drive.T_right_left;
  const auto residuals = std::make_unique<calibration::detail::MonitorResiduals>();
  residuals->reset();
  constexpr int kFrames = 75;
  calibration::detail::Evidence sum;
  double inflation = 0;
  MonitorTrial trial(drive);
  for (int i = 0; i < kFrames; ++i) {
    (void)trial.step();
    const auto found = residuals->stereo({T, drive.left, drive.right}, trial.frame(), 30);
    sum.add(found.evidence);
    inflation += found.spread_life / kFrames;
  }
  const auto factor = calibration::detail::with_prior(sum.A);
  Eigen::Matrix<double, 6, 5> d_transform = Eigen::Matrix<double, 6, 5>::Zero();
  d_transform.topLeftCorner<3, 3>().setIdentity();
  d_transform.bottomRightCorner<3, 2>() = T.t.norm() * tangent_basis(T.t.normalized());
  const Vec6 off = d_transform * factor.solve(sum.g);
  return {perturbed(T, off.head<3>(), off.tail<3>()),
          inflation * d_transform * factor.inverse() * d_transform.transpose()};
}

}  // namespace vergence::test
