#pragma once
#include <span>

namespace vergence {

/// Log-likelihood ratio of a calibration against chance for the matches of two images.
struct EpipolarEvidence {
  double log_likelihood_ratio = 0;  // of "the calibration fits" over "every match is by chance"
  double width_px = 0;              // of the distances' core, 1 σ as measured

  /// Chance matches are taken for true ones once in a million scenes (Wald 1945).
  [[nodiscard]] bool fits() const noexcept { return log_likelihood_ratio > 13.8; }
};

/// Weighs the distances of matches from their epipolar lines, px, 0 … `band_px`.
///
/// True matches lie about their lines as noise makes them (half of a Gaussian, whose width is
/// measured, at least `noise_px`), chance matches anywhere in the band that was searched. "Fits"
/// says that half of the matches found are true ones. Points without a match are not used. Threads
/// pure. Memory: orders `distances`.
[[nodiscard]] EpipolarEvidence weigh_epipolar_distances(std::span<float> distances, double band_px,
                                                        double noise_px) noexcept;

}  // namespace vergence
