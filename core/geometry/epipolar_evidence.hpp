#pragma once
#include <span>

namespace vergence {

/// Log-likelihood ratio of a calibration against chance for the matches of two images.
struct EpipolarEvidence {
  /// Log-likelihood ratio of a fitting calibration over all matches being chance.
  double log_likelihood_ratio = 0;
  /// Measured sigma of the distances' core.
  double width_px = 0;

  /// Accepts chance matches once in a million scenes (Wald 1945).
  [[nodiscard]] bool fits() const noexcept { return log_likelihood_ratio > 13.8; }
};

/// Evaluates the distances of matches from their epipolar lines, in px, 0 … `band_px`.
///
/// Distances of true matches follow half a Gaussian, whose width is measured but at least
/// `noise_px`; chance matches are uniform in the searched band. With a fitting calibration half of
/// the matches are assumed true. Pure, but reorders `distances`.
[[nodiscard]] EpipolarEvidence weigh_epipolar_distances(std::span<float> distances, double band_px,
                                                        double noise_px) noexcept;

}  // namespace vergence
