#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "core/calibration/detail/evidence_history.hpp"
#include "core/calibration/detail/monitor_evidence.hpp"
#include "core/calibration/detail/monitor_scatter.hpp"
#include "core/calibration/monitor.hpp"
#include "core/geometry/epipolar.hpp"

namespace vergence::calibration::detail {

/// What one moving frame brings.
struct FrameEvidence {
  std::uint64_t frame = 0;
  std::uint64_t before = 0;  // the earlier frame of the motion look
  TwoEvidences evidence;
  double spread_now = 0, spread_life = 0;  // of the StereoResiduals
  double spread_motion = -1;               // MotionResiduals::spread; negative: no look
};

/// What all windows together say. Angles rad, as θ.
struct Decision {
  MonitorVerdict::Kind kind = MonitorVerdict::Kind::quiet;
  double statistic = 0;
  bool undecided = false;  // over the threshold, but a lag would explain it as well so far
  Vec5 theta = Vec5::Zero();
  Mat5 covariance = Mat5::Zero();
  double lag = 0, lag_sigma = 0, yaw_sigma = 0;  // over the longest window
  std::uint64_t onset = 0;
  int frames = 0;  // measured since the onset
};

/// Evidence of the past moving frames in sliding windows, and the tests on it. It knows nothing of
/// images or tracks.
///
/// Memory  Fixed, in place (some 160 kB). Time: a few µs a frame; up to 0.1 ms while something is
///         over the threshold.
class ChangeDetector {
 public:
  /// covariance: of θ's first five at the reference.
  void reset(const MonitorOptions& options, const Mat5& covariance) noexcept;
  /// How much stretches of the drive are expected to disagree until that is measured; outlives
  /// reset(), as what was measured does.
  void expect_scatter(double bias_px) noexcept;
  /// A frame that stands out by itself counts once the next one does, too: a knock stays, and
  /// images that are spoilt once (skewed exposure, a shaken rolling shutter) do not.
  void push(const FrameEvidence& e) noexcept;
  [[nodiscard]] Decision decide() noexcept;
  /// The statistic of one frame by itself, `spread` its own λ: what a standing camera allows.
  [[nodiscard]] double single(const Evidence& stereo, double spread) const noexcept;
  /// What a lag of one frame would make of the statistic of a moving frame by itself. It grows with
  /// the way between two frames, hardly with the number of frames: the reference is no better
  /// known.
  [[nodiscard]] double lag_statistic(const Evidence& stereo) const noexcept;
  /// A⁻¹ g and A⁻¹ of that frame, floors included.
  void single_estimate(const Evidence& stereo, double spread, Vec5* theta,
                       Mat5* covariance) const noexcept;

  [[nodiscard]] double stereo_inflation() const noexcept { return lambda_stereo_; }
  [[nodiscard]] double motion_inflation() const noexcept { return lambda_motion_; }
  [[nodiscard]] std::uint64_t frames() const noexcept { return history_.frames(); }

 private:
  using Entry = EvidenceHistory::Entry;
  struct Onset {
    double gain = 0;  // twice the log likelihood ratio against "nothing has changed"
    std::uint64_t frame = 0;
    int frames = 0;
    Evidence since;  // inflated, without floor
    TwoEvidences raw;
  };
  struct Search {
    Onset step, ramp;                             // five; five growing from zero
    Onset step_stereo, both_stereo, ramp_stereo;  // the same without motion; five and the lag
  };

  void follow_spread(const FrameEvidence& e) noexcept;
  void take(const FrameEvidence& e) noexcept;
  [[nodiscard]] bool stands_out(const FrameEvidence& e) const noexcept;
  void measure_scatter() noexcept;
  void renew_floor() noexcept;
  [[nodiscard]] Evidence effective(const TwoEvidences& sum) const noexcept;
  [[nodiscard]] static double statistic(const Evidence& e, const Vec5& mean,
                                        const Mat5& covariance) noexcept;
  void learn(const TwoEvidences& window, Vec5* mean, Mat5* covariance) const noexcept;
  void estimate(const Evidence& e, Vec5* theta, Mat5* covariance) const noexcept;
  void search(const Vec5& mean, Search* found) const noexcept;
  [[nodiscard]] bool find_lag(const Search& found, Decision* d) const noexcept;
  [[nodiscard]] bool lag_is_rival(const Search& found) const noexcept;
  [[nodiscard]] TwoEvidences since(const Onset& onset) const noexcept;
  void attribute(std::size_t window, Decision* d) noexcept;

  MonitorOptions options_{};
  Mat5 covariance_ = Mat5::Zero();
  double bias2_ = 0;         // px², of a mode: the floor
  double motion_bias2_ = 0;  // and that of residuals of motion
  BlockScatter scatter_{};
  std::array<std::size_t, 6> detector_{};
  std::size_t window_count_ = 0;
  EvidenceHistory history_;
  std::optional<FrameEvidence> pending_;  // stands out, and waits for the next one
  double lambda_stereo_ = 0, lambda_motion_ = 0;
  double now_fast_ = 0, now_slow_ = 0, life_slow_ = 0;  // running means of the spreads
  std::uint64_t residuals_ = 0;
  double newest_statistic_ = 0;  // of the last decide()
  int over_ = 0;                 // frames in a row over the threshold
};

}  // namespace vergence::calibration::detail
