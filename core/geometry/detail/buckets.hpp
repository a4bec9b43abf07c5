#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "core/math/random.hpp"

namespace vergence::detail {

/// Bounding rectangle of observations, divided into buckets; drawing at most one observation per
/// bucket spreads a sample.
class PixelBox {
 public:
  static constexpr int
      kColumns = 8,
      /// There are 48 buckets, so that a sample of five still finds five in a half-covered image.
      kRows = 6;

  void include(double u, double v) noexcept {
    u0_ = std::min(u0_, u), u1_ = std::max(u1_, u), v0_ = std::min(v0_, v), v1_ = std::max(v1_, v);
  }
  /// Precondition: (u, v) was included.
  [[nodiscard]] std::uint8_t bucket(double u, double v) const noexcept {
    return static_cast<std::uint8_t>(cell(u, u0_, u1_, kColumns) +
                                     kColumns * cell(v, v0_, v1_, kRows));
  }

 private:
  [[nodiscard]] static int cell(double x, double lo, double hi, int n) noexcept {
    const double s = hi > lo ? (x - lo) / (hi - lo) : 0.0;
    return std::clamp(static_cast<int>(s * n), 0, n - 1);
  }
  static constexpr double kFar = std::numeric_limits<double>::max();
  double u0_ = kFar, u1_ = -kFar, v0_ = kFar, v1_ = -kFar;
};

/// Draws N different indices into `bucket`, uniformly over the items, from different buckets if
/// kTries suffice. Returns false if there are fewer than N items or no different ones were found.
template <std::size_t N>
[[nodiscard]] bool draw_spread(std::span<const std::uint8_t> bucket, Random& random,
                               std::array<std::uint32_t, N>* picks) noexcept {
  /// A bucket with half of all items is avoided in all but 2⁻¹² of the draws.
  constexpr int kTries = 12;
  if (bucket.size() < N) return false;
  for (std::size_t j = 0; j < N; ++j) {
    bool found = false;
    for (int attempt = 0; attempt < 2 * kTries && !found; ++attempt) {
      const std::uint32_t i = random.below(static_cast<std::uint32_t>(bucket.size()));
      const bool insist = attempt < kTries;
      found = true;
      for (std::size_t l = 0; l < j; ++l)
        if ((*picks)[l] == i || (insist && bucket[(*picks)[l]] == bucket[i])) found = false;
      if (found) (*picks)[j] = i;
    }
    if (!found) return false;
  }
  return true;
}

}  // namespace vergence::detail
