#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "core/calibration/detail/evidence_history.hpp"
#include "core/calibration/detail/monitor_evidence.hpp"
#include "core/calibration/detail/monitor_residuals.hpp"
#include "core/calibration/detail/monitor_scatter.hpp"

namespace vergence::calibration::detail {

/// Change tests on the evidence of past moving frames in sliding windows. Independent of images and
/// tracks.
///
/// Memory  Fixed, in place (about 50 kB). Time: a few µs per frame; up to 0.1 ms during an alarm.
class ChangeDetector {
 public:
  /// `covariance`: of θ at the reference.
  void reset(const MonitorOptions& options, const Mat5& covariance) noexcept;
  void expect_scatter(double bias_px) noexcept;
  /// A frame that exceeds the threshold on its own counts only if the next one does as well: a
  /// knock lasts, whereas a distorted image (skewed exposure, a shaken rolling shutter) does not.
  void push(const StereoResiduals& e) noexcept;
  /// Combined result of all windows, without `rotation_mrad`.
  [[nodiscard]] MonitorResult decide() noexcept;
  /// Statistic of a single frame, for a standing rig; `spread` is its own inflation λ.
  [[nodiscard]] double single(const Evidence& frame, double spread) const noexcept;

 private:
  using Entry = EvidenceHistory::Entry;
  struct Onset {
    // Twice the log likelihood ratio against no change.
    double gain = 0;
    std::uint64_t frame = 0;
    // Evidence since the onset, not inflated; that of a ramp is weighted by the ramp.
    Evidence since;
  };
  struct Search {
    // A sudden change, and one that grows from zero.
    Onset step, ramp;
  };

  void follow_spread(const StereoResiduals& e) noexcept;
  void add(const StereoResiduals& e) noexcept;
  [[nodiscard]] bool stands_out(const StereoResiduals& e) const noexcept;
  void measure_scatter() noexcept;
  void renew_floor() noexcept;
  [[nodiscard]] Evidence effective(const Evidence& sum) const noexcept;
  [[nodiscard]] static double statistic(const Evidence& e, const Vec5& mean,
                                        const Mat5& covariance) noexcept;
  void estimate_reference(const Evidence& window, Vec5* mean, Mat5* covariance) const noexcept;
  void search(const Vec5& mean, Search* found) const noexcept;
  void attribute(std::size_t window, MonitorResult* d) const noexcept;

  MonitorOptions options_{};
  Mat5 covariance_ = Mat5::Zero();
  // Variance of the slowly varying error per parameter, in px².
  double bias2_ = 0;
  BlockScatter scatter_{};
  std::array<std::size_t, 6> detector_{};
  std::size_t window_count_ = 0;
  EvidenceHistory history_;
  // Frame above the threshold that waits for the next one.
  std::optional<StereoResiduals> pending_;
  double lambda_ = 0;
  // Running means of the spreads.
  double now_fast_ = 0, now_slow_ = 0, life_slow_ = 0;
  double newest_statistic_ = 0;
  // Number of consecutive frames above the threshold.
  int over_ = 0;
};

}  // namespace vergence::calibration::detail
