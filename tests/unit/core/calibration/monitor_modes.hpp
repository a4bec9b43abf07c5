#pragma once
#include <Eigen/Cholesky>

#include "core/calibration/detail/change_detector.hpp"
#include "tests/unit/core/calibration/monitor_trial.hpp"

namespace vergence::test {

/// Simulates a monitor's input below the level of tracks: the information of recorded frames, and
/// gradients drawn with the variances, the correlation in time and the slow error of the recorded
/// tracks. Much faster than simulating tracks.
class ModeDrive {
 public:
  struct Frame {
    calibration::detail::StereoResiduals evidence;
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
    if (f.moving) {
      // Errors that stay with a track die with it: correlation 0.9 a frame has the same sum over a
      // life of twenty.
      track_ = kTrackKeeps * track_ + std::sqrt(1 - kTrackKeeps * kTrackKeeps) * draw();
      const double lasting = (spread_life_ - spread_now_) * (1 - kTrackKeeps) / (2 * kTrackKeeps);
      noise_ = std::sqrt(lasting) * track_ + std::sqrt(spread_now_ - lasting) * draw();
    }
    calibration::detail::Evidence& e = f.evidence.evidence;
    set_gradient(&e, noise_ + std::sqrt(e.n) * (bias_of_ * bias_), reference_error);
    return f;
  }

 private:
  // Outliers that pass for matches and modes that share the noise unequally: what Gaussian modes
  // lack, found by the comparison with tracks.
  static constexpr double kLarger = 1.1;
  static constexpr double kTrackKeeps = 0.9;
  // The correlation time is 10 s at 30 Hz.
  static constexpr double kBiasKeeps = 0.99667;

  [[nodiscard]] Vec5 draw() {
    Vec5 y;
    for (int i = 0; i < 5; ++i) y[i] = random_.normal();
    return kLarger * y;
  }

  /// g = L y − A θ of the reference's error.
  static void set_gradient(calibration::detail::Evidence* e, const Vec5& y,
                           const Vec5& reference_error) {
    using namespace calibration::detail;
    e->g = Eigen::LLT<Mat5>(e->A).matrixL() * y - e->A * reference_error;
  }

  template <class Use>
  static void watch(const FeatureDriveOptions& o, int frames, const Use& use) {
    using namespace calibration::detail;
    const auto looks = std::make_unique<MonitorResiduals>();
    looks->reset();
    const calibration::StereoPair pair{o.T_right_left, o.left, o.right};
    MonitorTrial trial(o);
    for (int i = 0; i < frames; ++i) {
      (void)trial.step();
      const calibration::MonitorFrame& f = trial.frame();
      const StereoResiduals stereo = looks->stereo(pair, f, 30);
      if (!stereo.usable) continue;
      use(f, stereo);
    }
  }

  void record(FeatureDriveOptions o) {
    o.drive_s = 60, o.stop_s = 15;
    int moving = 0;
    watch(o, 2250, [&](const calibration::MonitorFrame& frame, const auto& stereo) {
      frames_.push_back({stereo, frame.moving, stereo.spread_now});
      if (!frame.moving || frame.frame < 100) return;
      ++moving, spread_now_ += stereo.spread_now, spread_life_ += stereo.spread_life;
    });
    spread_now_ /= moving, spread_life_ /= moving;
  }

  void measure_bias(FeatureDriveOptions o) {
    using namespace calibration::detail;
    o.white_px = o.constant_px = o.walk_px = 1e-5;
    o.outliers = o.movers = 0;
    // A short time constant gives many draws of the field.
    o.bias_s = 1;
    Mat5 sum = Mat5::Zero();
    int n = 0;
    watch(o, 2500, [&](const auto&, const auto& stereo) {
      const Evidence& e = stereo.evidence;
      const Vec5 y = with_prior(e.A).whitening() * e.g / std::sqrt(e.n);
      sum += y * y.transpose();
      ++n;
    });
    bias_of_ = Eigen::LLT<Mat5>(sum / n).matrixL();
  }

  Random random_;
  std::vector<Frame> frames_;
  std::size_t at_ = 0;
  std::uint64_t number_ = 0;
  double spread_now_ = 0, spread_life_ = 0;
  // Bias of each whitened mode, in px.
  Mat5 bias_of_ = Mat5::Zero();
  Vec5 track_, bias_, noise_ = Vec5::Zero();
};

}  // namespace vergence::test
