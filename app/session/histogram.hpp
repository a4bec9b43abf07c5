#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace vergence::app {

/// Times in fixed memory, however many: mean and largest exact, percentiles to 0.25 %.
///
/// Bins grow by the factor 1 + 1/200 from 1 µs on; 4000 of them reach 460 s. Threads  One.
class TimeHistogram {
 public:
  void add(double ms) noexcept {
    if (!(ms >= 0)) return;  // NaN is no time
    ++count_;
    sum_ += ms;
    max_ = std::max(max_, ms);
    const double place = std::log(std::max(ms, kLeast) / kLeast) / kLogStep;
    ++bins_[std::min(static_cast<std::size_t>(place), kBins - 1)];
  }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  /// ms; 0 without a time.
  [[nodiscard]] double mean() const noexcept {
    return count_ == 0 ? 0 : sum_ / static_cast<double>(count_);
  }
  [[nodiscard]] double max() const noexcept { return max_; }
  /// The least time that at least the share q of all does not exceed: the middle of its bin, at
  /// most max(). 0 without a time.
  [[nodiscard]] double percentile(double q) const noexcept {
    if (count_ == 0) return 0;
    const auto requested = std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_))));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < kBins; ++i) {
      seen += bins_[i];
      if (seen >= requested)
        return std::min(max_, kLeast * std::exp((static_cast<double>(i) + 0.5) * kLogStep));
    }
    return max_;
  }

 private:
  static constexpr std::size_t kBins = 4000;
  static constexpr double kLeast = 1e-3;                    // ms
  static constexpr double kLogStep = 0.004987541511038968;  // ln(1.005)
  std::array<std::uint32_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  double sum_ = 0, max_ = 0;
};

}  // namespace vergence::app
