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

/// Evidence of one moving frame.
struct FrameEvidence {
  std::uint64_t frame = 0;
  Evidence evidence;
  double spread_now = 0, spread_life = 0;  // of the StereoResiduals
};

/// Result of all windows together.
struct Decision {
  MonitorResult::Kind kind = MonitorResult::Kind::quiet;
  double statistic = 0;
  bool undecided = false;  // the newest frame stands out by itself, and waits for the next one
  double shift_px = 0;     // rms that the change since the onset moves matches by; 0 with `quiet`
  std::uint64_t onset = 0;
  int frames = 0;  // measured since the onset
};

/// Evidence of the past moving frames in sliding windows, and the tests on it. Independent of
/// images and tracks.
///
/// Memory  Fixed, in place (some 50 kB). Time: a few µs a frame; up to 0.1 ms while something is
///         over the threshold.
class ChangeDetector {
 public:
  /// covariance: of θ's first five at the reference.
  void reset(const MonitorOptions& options, const Mat5& covariance) noexcept;
  /// As Monitor::expect_scatter().
  void expect_scatter(double bias_px) noexcept;
  /// A frame that stands out by itself counts once the next one does, too: a knock stays, and
  /// images that are spoilt once (skewed exposure, a shaken rolling shutter) do not.
  void push(const FrameEvidence& e) noexcept;
  [[nodiscard]] Decision decide() noexcept;
  /// The statistic of one frame by itself, `spread` its own λ: what a standing camera allows.
  [[nodiscard]] double single(const Evidence& frame, double spread) const noexcept;

 private:
  using Entry = EvidenceHistory::Entry;
  struct Onset {
    double gain = 0;  // twice the log likelihood ratio against "nothing has changed"
    std::uint64_t frame = 0;
    int frames = 0;
    Evidence since;  // not inflated; of a ramp, weighted by it
  };
  struct Search {
    Onset step, ramp;  // a change at a moment; one that grows from zero
  };

  void follow_spread(const FrameEvidence& e) noexcept;
  void take(const FrameEvidence& e) noexcept;
  [[nodiscard]] bool stands_out(const FrameEvidence& e) const noexcept;
  void measure_scatter() noexcept;
  void renew_floor() noexcept;
  [[nodiscard]] Evidence effective(const Evidence& sum) const noexcept;
  [[nodiscard]] static double statistic(const Evidence& e, const Vec5& mean,
                                        const Mat5& covariance) noexcept;
  void estimate_reference(const Evidence& window, Vec5* mean, Mat5* covariance) const noexcept;
  void search(const Vec5& mean, Search* found) const noexcept;
  void attribute(std::size_t window, Decision* d) const noexcept;

  MonitorOptions options_{};
  Mat5 covariance_ = Mat5::Zero();
  double bias2_ = 0;  // px², of a mode: the floor
  BlockScatter scatter_{};
  std::array<std::size_t, 6> detector_{};
  std::size_t window_count_ = 0;
  EvidenceHistory history_;
  std::optional<FrameEvidence> pending_;  // stands out, and waits for the next one
  double lambda_ = 0;
  double now_fast_ = 0, now_slow_ = 0, life_slow_ = 0;  // running means of the spreads
  double newest_statistic_ = 0;                         // of the last decide()
  int over_ = 0;                                        // frames in a row over the threshold
};

}  // namespace vergence::calibration::detail
