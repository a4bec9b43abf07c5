#pragma once
#include <algorithm>
#include <cstddef>
#include <span>

/// Robust statistics that several rooms of core use.
namespace vergence {

inline constexpr double kMedianOfNormal = 0.6745;  // of |x|, x standard normal
// Scales beyond which Tukey's biweight leaves an error out: 95 % efficient for normal ones.
inline constexpr double kTukey = 4.685;
inline constexpr double kChi2OfPixel = 9.21;  // χ² of two coordinates at 99 %

/// The upper median; reorders. Precondition: not empty.
template <class T>
[[nodiscard]] T median(std::span<T> values) noexcept {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace vergence
