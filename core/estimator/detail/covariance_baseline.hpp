#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>

#include "core/math/robust.hpp"

namespace vergence {

/// Baseline of the motions' uncertainty: the median of the last ones. A motion whose sigma is
/// several times larger is reported as less reliable, whatever the cause; a single certain motion
/// among uncertain ones does not end the report.
///
/// Without faults no motion is more than 1.6 times as uncertain as usual on the recorded drives,
/// and 2.3 times on the rendered street (build/bench/covariance_bench). Cameras out of sync give
/// more than 4 times, a tunnel 3 times from its third frame on
/// (FaultPairs.imageLateAfterALostOneIsNotOk).
///
/// Threads  One. Memory: none of the heap.
class CovarianceBaseline {
 public:
  /// Standing still, residuals are smaller than they are on the way: such motions are no measure,
  /// and need none. By the usual sigma: the more uncertain a motion, the more it has to be judged.
  [[nodiscard]] bool measurable(double step_m, double sigma_m) const noexcept {
    constexpr double kMoves = 2;  // sigmas
    return step_m > kMoves * (kept_ >= kMin ? median() : sigma_m);
  }
  /// Returns true from a motion more than 3 times as uncertain as usual on, until the last three
  /// are less than twice as uncertain, root mean square. A motion judged so makes nothing usual:
  /// what stays so uncertain is reported for as long.
  ///
  /// sigma_m: of the translation of a motion that measurable(), m.
  [[nodiscard]] bool unusual(double sigma_m) noexcept {
    recent_[evaluated_++ % kRecent] = sigma_m * sigma_m;
    times_ = kept_ >= kMin ? sigma_m / median() : 0;
    const double squares = std::accumulate(recent_.begin(), recent_.end(), 0.0);
    unusual_ = unusual_ ? std::sqrt(squares / kRecent) > kRelease * median() : times_ > kTimes;
    if (unusual_) return true;
    sigma_[next_] = sigma_m;
    next_ = (next_ + 1) % kKept;
    kept_ = std::min(kept_ + 1, kKept);
    return false;
  }

  /// Sigma of the last motion over the baseline; 0 with too few motions to have one.
  [[nodiscard]] double times_usual() const noexcept { return times_; }

 private:
  static constexpr std::size_t kKept = 61, kMin = 15, kRecent = 3;  // motions
  static constexpr double kTimes = 3, kRelease = 2;

  [[nodiscard]] double median() const noexcept {
    std::array<double, kKept> sorted = sigma_;
    return vergence::median(std::span(sorted).first(kept_));
  }

  std::array<double, kKept> sigma_{};
  std::size_t next_ = 0, kept_ = 0;
  std::array<double, kRecent> recent_{};  // squares
  std::size_t evaluated_ = 0;
  double times_ = 0;  // the last one
  bool unusual_ = false;
};

}  // namespace vergence
