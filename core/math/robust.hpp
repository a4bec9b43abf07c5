#pragma once
#include <algorithm>
#include <cstddef>
#include <span>

/// Robust statistics for several folders of core.
namespace vergence {

/// Median of |x| for x standard normal.
inline constexpr double kMedianOfNormal = 0.6745;
// Threshold of Tukey's biweight in scales; 95 % efficient for normal errors.
inline constexpr double kTukey = 4.685;
/// Minimum scale of residuals, in px or in sigmas of about as much; corners are not localised
/// better.
inline constexpr double kMinScale = 0.05;
/// Number of reweighting rounds; two reduce the scale from that of a shifted set to that of the
/// noise.
inline constexpr int kReweightings = 3;
/// Number of standard errors that a decision needs which is repeated with every frame or solve.
inline constexpr double kCertainSigmas = 3.0;
/// χ² of two coordinates at 99 %.
inline constexpr double kChi2OfPixel = 9.21;

/// Upper median; reorders the values. Precondition: not empty.
template <class T>
[[nodiscard]] T median(std::span<T> values) noexcept {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace vergence
