#include "core/geometry/epipolar_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/robust.hpp"

namespace vergence {

EpipolarEvidence weigh_epipolar_distances(std::span<float> distances, double band_px,
                                          double noise_px) noexcept {
  constexpr double kTrueShare = 0.5;
  EpipolarEvidence e;
  if (distances.empty()) return e;
  // The limit is half of the band, the median of chance matches alone.
  e.width_px = std::clamp(static_cast<double>(median(distances)) / kMedianOfNormal, noise_px,
                          std::max(noise_px, 0.5 * band_px));
  const double peak = band_px * std::sqrt(2 / std::numbers::pi) / e.width_px;
  for (const float distance : distances) {
    const double sigmas = static_cast<double>(distance) / e.width_px;
    e.log_likelihood_ratio +=
        std::log(kTrueShare * peak * std::exp(-0.5 * sigmas * sigmas) + 1 - kTrueShare);
  }
  return e;
}

}  // namespace vergence
