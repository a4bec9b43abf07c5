#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

/// Robust statistics for several folders of core.
namespace vergence {

/// Median of |x| for x standard normal.
inline constexpr double kMedianOfNormal = 0.6745;
/// Thresholds of Huber's loss and of Tukey's biweight in scales; 95 % efficient for normal errors.
inline constexpr double kHuber = 1.345, kTukey = 4.685;
/// Minimum scale of residuals, in px or in sigmas of about that size; corners are not more
/// accurate.
inline constexpr double kMinScale = 0.05;
/// Number of reweighting rounds; two reduce the scale from that of a shifted set to that of the
/// noise.
inline constexpr int kReweightings = 3;
/// Number of standard errors that make a single comparison significant.
inline constexpr double kChance = 2.0;
/// Number of standard errors required for a decision that is repeated in every frame or solve.
inline constexpr double kCertainSigmas = 3.0;
/// Number of sigmas beyond which a single value is not noise: noise exceeds it less than once in a
/// million values.
inline constexpr double kOutlierSigmas = 5.0;
/// Minimum number of values or frames for a mean and its standard error, which is then accurate to
/// a third.
inline constexpr int kMinForMean = 6;
/// Ratio of two widths (sigmas, median distances) above which they have different causes: if both
/// are accurate to a third, chance gives this ratio once in a hundred cases.
inline constexpr double kUnusualRatio = 3.0;
/// Minimum number of tracks for a median or a share of one frame; the median then has a quarter of
/// a track's sigma, the share an error of 0.1.
inline constexpr std::size_t kMinTracksOfFrame = 25;
/// Share of what is expected above which evidence counts: a majority.
inline constexpr double kMajority = 0.5;
/// Minimum number of inliers that do not agree by chance. Three points determine a pose; five more
/// of thirty, found within 32 px, agree with it to half a pixel once in 10¹⁰ hypotheses.
inline constexpr int kMinAgreeing = 8;
/// χ² of two coordinates at 99 %.
inline constexpr double kChi2OfPixel = 9.21;

/// Log odds that a difference, measured with sigma `measured`, is of the usual kind (sigma `usual`)
/// rather than of another (sigma `other`):
///
///     log N(d; 0, usual² + measured²) − log N(d; 0, other² + measured²)
[[nodiscard]] inline double log_odds(double difference, double measured, double usual,
                                     double other) noexcept {
  const double same = usual * usual + measured * measured,
               wrong = other * other + measured * measured;
  return 0.5 * (std::log(wrong / same) - difference * difference * (1 / same - 1 / wrong));
}

/// Weight of a squared residual by Tukey's biweight; 0 beyond `limit`.
[[nodiscard]] inline double tukey(double squared, double limit) noexcept {
  const double u = 1.0 - squared / (limit * limit);
  return u > 0 ? u * u : 0.0;
}

/// Upper median; reorders the values. Precondition: not empty.
template <class T>
[[nodiscard]] T median(std::span<T> values) noexcept {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace vergence
