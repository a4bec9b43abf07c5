#pragma once
#include <Eigen/Cholesky>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/calibration/detail/change_detector.hpp"
#include "core/calibration/detail/monitor_residuals.hpp"
#include "core/math/random.hpp"
#include "tests/unit/core/calibration/monitor_trial.hpp"

namespace vergence::test {

/// What a drive shows a monitor, below the level of tracks: the information of recorded frames, and
/// gradients drawn anew with the variances, the correlation in time and the slow error that the
/// recorded tracks had. A thousand times an hour's tracks in a minute.
class ModeDrive {
 public:
  struct Frame {
    calibration::detail::FrameEvidence evidence;
    bool moving = false;
    double spread_now = 0;
  };

  /// Records one cycle of driving and standing from a feature drive, and from a second one without
  /// noise what the slow error does to it.
  explicit ModeDrive(const FeatureDriveOptions& options, std::uint64_t seed) : random_(seed, 5) {
    record(options);
    measure_bias(options);
    track_ = draw();
    bias_ = draw();
  }

  /// The next frame. `reference_error`: the reference is off by so much (θ).
  [[nodiscard]] Frame next(const Vec5& reference_error) {
    const Frame& recorded = frames_[at_];
    at_ = (at_ + 1) % frames_.size();
    bias_ = kBiasKeeps * bias_ + std::sqrt(1 - kBiasKeeps * kBiasKeeps) * draw();
    Frame f = recorded;
    f.evidence.frame = number_++;
    f.evidence.before = f.evidence.frame > 8 ? f.evidence.frame - 8 : 0;
    if (f.moving) {
      // Errors that stay with a track die with it: correlation 0.9 a frame has the same sum over a
      // life of twenty.
      track_ = kTrackKeeps * track_ + std::sqrt(1 - kTrackKeeps * kTrackKeeps) * draw();
      const double lasting = (spread_life_ - spread_now_) * (1 - kTrackKeeps) / (2 * kTrackKeeps);
      noise_ = std::sqrt(lasting) * track_ + std::sqrt(spread_now_ - lasting) * draw();
    }  // else the images repeat themselves, and so do their errors
    auto& [stereo, motion] = f.evidence.evidence;
    set_gradient(&stereo, noise_ + std::sqrt(stereo.n) * (bias_stereo_ * bias_), reference_error);
    if (motion.n > 0)
      set_gradient(
          &motion,
          std::sqrt(spread_motion_) * draw() + std::sqrt(motion.n) * (bias_motion_ * bias_),
          reference_error);
    return f;
  }

 private:
  // Outliers that pass for matches and modes that share the noise unequally: what Gaussian modes
  // lack, found by the comparison with tracks.
  static constexpr double kLarger = 1.1;
  static constexpr double kTrackKeeps = 0.9;
  static constexpr double kBiasKeeps = 0.99667;  // 10 s at 30 Hz

  [[nodiscard]] Vec6 draw() {
    Vec6 y;
    for (int i = 0; i < 6; ++i) y[i] = random_.normal();
    return kLarger * y;
  }

  /// g = L y − A θ of the reference's error, the lag left out of the latter.
  static void set_gradient(calibration::detail::Evidence* e, const Vec6& y,
                           const Vec5& reference_error) {
    using namespace calibration::detail;
    const Solved factor(e->A, e->g);
    for (int i = 0; i < kTheta; ++i) {
      double g = 0;
      for (int k = 0; k <= i; ++k)
        if (factor.seen[static_cast<std::size_t>(k)]) g += factor.L[lower(i, k)] * y[k];
      for (int k = 0; k < kFixed; ++k)
        g -= e->A[lower(std::max(i, k), std::min(i, k))] * reference_error[k];
      e->g[static_cast<std::size_t>(i)] = g;
    }
  }

  template <class Use>
  static void watch(const FeatureDriveOptions& o, int frames, const Use& use) {
    using namespace calibration::detail;
    const auto looks = std::make_unique<MonitorResiduals>();
    looks->reset();
    const Reference reference{o.T_right_left,
                              EpipolarGeometry(o.T_right_left),
                              tangent_basis(o.T_right_left.t.normalized()),
                              o.T_right_left.t.norm(),
                              o.left,
                              o.right};
    MonitorTrial trial(o);
    for (int i = 0; i < frames; ++i) {
      (void)trial.step();
      const calibration::MonitorFrame& f = trial.frame();
      const StereoResiduals stereo = looks->stereo(reference, f, 30, f.moving);
      if (!stereo.usable) continue;
      use(f, stereo,
          f.motion.empty() || !f.moving ? MotionResiduals{} : looks->motion(reference, f));
    }
  }

  void record(FeatureDriveOptions o) {
    o.drive_s = 60, o.stop_s = 15;
    int moving = 0, looks = 0;
    watch(o, 2250,
          [&](const calibration::MonitorFrame& frame, const auto& stereo, const auto& motion) {
            Frame f;
            f.moving = frame.moving;
            f.spread_now = stereo.spread_now;
            f.evidence.evidence.stereo = stereo.evidence;
            f.evidence.spread_now = stereo.spread_now;
            f.evidence.spread_life = stereo.spread_life;
            if (motion.usable)
              f.evidence.evidence.motion = motion.evidence,
              f.evidence.spread_motion = motion.spread;
            frames_.push_back(f);
            if (!frame.moving || frame.frame < 100) return;
            ++moving, spread_now_ += stereo.spread_now, spread_life_ += stereo.spread_life;
            if (motion.usable) ++looks, spread_motion_ += motion.spread;
          });
    spread_now_ /= moving, spread_life_ /= moving, spread_motion_ /= looks;
  }

  void measure_bias(FeatureDriveOptions o) {
    using namespace calibration::detail;
    o.white_px = o.constant_px = o.walk_px = 1e-5;
    o.outliers = o.movers = 0;
    o.bias_s = 1;  // many draws of the field
    Mat6 stereo_sum = Mat6::Zero(), motion_sum = Mat6::Zero();
    int stereo_n = 0, motion_n = 0;
    const auto add = [](const Evidence& e, Mat6* sum, int* n) {
      const Solved solved(e.A, e.g);
      const Vec6 y = Eigen::Map<const Vec6>(solved.y.data()) / std::sqrt(e.n);
      *sum += y * y.transpose();
      ++*n;
    };
    watch(o, 2500, [&](const auto&, const auto& stereo, const auto& motion) {
      add(stereo.evidence, &stereo_sum, &stereo_n);
      if (motion.usable) add(motion.evidence, &motion_sum, &motion_n);
    });
    bias_stereo_ = Eigen::LLT<Mat6>(stereo_sum / stereo_n).matrixL();
    bias_motion_ = Eigen::LLT<Mat6>(motion_sum / motion_n).matrixL();
  }

  Random random_;
  std::vector<Frame> frames_;
  std::size_t at_ = 0;
  std::uint64_t number_ = 0;
  double spread_now_ = 0, spread_life_ = 0, spread_motion_ = 0;
  Mat6 bias_stereo_ = Mat6::Zero(), bias_motion_ = Mat6::Zero();  // px a mode, whitened
  Vec6 track_, bias_, noise_ = Vec6::Zero();
};

}  // namespace vergence::test
