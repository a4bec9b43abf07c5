#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>

#include "core/math/robust.hpp"

namespace vergence {

/// Baseline of the motions' uncertainty: the median over recent motions. A motion whose sigma is
/// several times larger is reported; a single certain motion among uncertain ones does not end the
/// report.
///
/// Without faults no motion is more than 1.6 times as uncertain as the baseline on recorded
/// sequences, and 2.3 times on the rendered street (build/bench/margin_bench). Cameras out of
/// sync give more than 4 times, a tunnel 3 times (FaultPairs.imageLateAfterALostOneIsNotOk).
///
/// Not thread-safe. Does not allocate.
class CovarianceBaseline {
 public:
  /// Returns true if the motion is significant against the baseline's sigma. Residuals are smaller
  /// at standstill, so such motions must not enter the baseline.
  [[nodiscard]] bool measurable(double step_m, double sigma_m) const noexcept {
    return step_m > kChance * (known() ? median() : sigma_m);
  }
  /// Adds a motion. Returns true if it is unusually uncertain; it does not enter the baseline then.
  [[nodiscard]] bool update(double sigma_m) noexcept {
    recent_[evaluated_++ % kRecent] = sigma_m * sigma_m;
    ratio_ = known() ? sigma_m / median() : 0;
    const double squares = std::accumulate(recent_.begin(), recent_.end(), 0.0);
    unusual_ = ratio_ > kUnusualRatio ||
               (unusual_ && std::sqrt(squares / kRecent) > kUnusualRatio * median());
    if (unusual_) return true;
    sigma_[next_] = sigma_m;
    next_ = (next_ + 1) % kKept;
    kept_ = std::min(kept_ + 1, kKept);
    return false;
  }

  /// Sigma of the last motion over the limit of a usual one; 0 while there are too few motions.
  [[nodiscard]] double margin() const noexcept { return ratio_ / kUnusualRatio; }

 private:
  // Numbers of motions in the baseline (six seconds at 10 Hz) and in the test for the end, so that
  // one certain motion among uncertain ones ends nothing.
  static constexpr std::size_t kKept = 61, kRecent = 3;

  // The standard error of the median of a quarter of the motions is a third of their scatter.
  [[nodiscard]] bool known() const noexcept { return kept_ >= kKept / 4; }

  [[nodiscard]] double median() const noexcept {
    std::array<double, kKept> sorted = sigma_;
    return vergence::median(std::span(sorted).first(kept_));
  }

  std::array<double, kKept> sigma_{};
  std::size_t next_ = 0, kept_ = 0;
  // Variances of the most recent motions, in m².
  std::array<double, kRecent> recent_{};
  std::size_t evaluated_ = 0;
  // Sigma of the last motion over the baseline.
  double ratio_ = 0;
  bool unusual_ = false;
};

}  // namespace vergence
