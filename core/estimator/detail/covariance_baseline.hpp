#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/math/robust.hpp"

namespace vergence {

/// Baseline of the motions' uncertainty: the median over recent motions. A motion whose sigma is
/// several times larger is unusual, until such motions have lasted so long that they are usual.
///
/// Without faults the ratio is at most 2.0 on the recorded sequences except `sand_rover`; there and
/// on the rendered street some motions exceed the limit (build/bench/margin_bench, robustness_bench
/// drives). Cameras out of sync give more than 4 times, a tunnel 3 times
/// (FaultPairs.imageLateAfterALostOneIsNotOk).
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
    ratio_ = known() ? sigma_m / median() : 0;
    if (ratio_ > kUnusualRatio && ++unusual_ < kUsual) return true;
    if (unusual_ == kUsual) kept_ = next_ = 0;
    unusual_ = 0;
    sigma_[next_] = sigma_m;
    next_ = (next_ + 1) % kKept;
    kept_ = std::min(kept_ + 1, kKept);
    return false;
  }

  /// Sigma of the last motion over the limit of a usual one; 0 while there are too few motions.
  [[nodiscard]] double margin() const noexcept { return ratio_ / kUnusualRatio; }

 private:
  // Number of motions in the baseline: six seconds at 10 Hz.
  static constexpr std::size_t kKept = 61;
  // Number of consecutive unusual motions after which they count as usual: a minute at 10 Hz,
  // longer than most tunnels. For example, after an hour's stand into dusk no motion is as certain
  // as before.
  static constexpr int kUsual = 600;

  // The standard error of the median of a quarter of the motions is a third of their scatter.
  [[nodiscard]] bool known() const noexcept { return kept_ >= kKept / 4; }

  [[nodiscard]] double median() const noexcept {
    std::array<double, kKept> sorted = sigma_;
    return vergence::median(std::span(sorted).first(kept_));
  }

  std::array<double, kKept> sigma_{};
  std::size_t next_ = 0, kept_ = 0;
  // Number of consecutive unusual motions.
  int unusual_ = 0;
  // Sigma of the last motion over the baseline.
  double ratio_ = 0;
};

}  // namespace vergence
