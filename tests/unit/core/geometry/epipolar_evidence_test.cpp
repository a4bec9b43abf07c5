// Likelihood of a calibration from distances to epipolar lines.
#include "core/geometry/epipolar_evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/math/random.hpp"

namespace vergence {
namespace {

// Both are in px.
constexpr double kBand = 2.0, kNoise = 0.2;

std::vector<float> distances(int fitting, int chance, double width_px) {
  Random random(3);
  std::vector<float> d;
  for (int i = 0; i < fitting; ++i)
    d.push_back(static_cast<float>(std::min(kBand, std::abs(width_px * random.normal()))));
  for (int i = 0; i < chance; ++i) d.push_back(static_cast<float>(kBand * random.uniform()));
  return d;
}

EpipolarEvidence weigh(std::vector<float> d) { return weigh_epipolar_distances(d, kBand, kNoise); }

TEST(EpipolarEvidence, thirtyTrueMatchesFit) {
  const EpipolarEvidence e = weigh(distances(30, 0, kNoise));
  EXPECT_TRUE(e.fits()) << e.log_likelihood_ratio;
  // The median of thirty is known to a sixth of a sigma.
  EXPECT_NEAR(e.width_px, kNoise, 0.5 * kNoise);
}

TEST(EpipolarEvidence, chanceMatchesNeverFit) {
  for (const int n : {0, 1, 10, 100, 1000}) EXPECT_FALSE(weigh(distances(0, n, 1)).fits()) << n;
  // More of it speaks more against.
  EXPECT_LT(weigh(distances(0, 1000, 1)).log_likelihood_ratio,
            weigh(distances(0, 100, 1)).log_likelihood_ratio);
}

TEST(EpipolarEvidence, widerResidualsNeedMoreMatches) {
  EXPECT_FALSE(weigh(distances(20, 0, 3 * kNoise)).fits());
  EXPECT_TRUE(weigh(distances(200, 0, 3 * kNoise)).fits());
}

}  // namespace
}  // namespace vergence
