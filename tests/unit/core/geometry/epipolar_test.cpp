#include "core/geometry/epipolar.hpp"

#include <vector>

#include "core/geometry/epipolar_evidence.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/unit/core/geometry/random_scene.hpp"

namespace vergence {
namespace {

using Value = Eigen::Matrix<double, 1, 1>;

Transform random_stereo(Random& random) {
  return {exp_so3(test::random_vector(random, -0.5, 0.5)), test::random_vector(random, -1, 1)};
}

Vec2 ray_of(const Vec3& p) { return {p.x() / p.z(), p.y() / p.z()}; }

TEST(Epipolar, trueMatchesHaveNoResidual) {
  Random random(41);
  for (int k = 0; k < 1000; ++k) {
    const Transform T = random_stereo(random);
    const Vec3 p = test::visible_point(random, 4, 40);
    const EpipolarGeometry geometry(T);
    double sampson = 1, line = 1;
    ASSERT_TRUE(geometry.sampson(ray_of(p), ray_of(T * p), &sampson, nullptr));
    ASSERT_TRUE(geometry.to_line(ray_of(p), ray_of(T * p), &line, nullptr));
    EXPECT_NEAR(sampson, 0, 1e-13);
    EXPECT_NEAR(line, 0, 1e-13);
    double left = 0, right = 0;
    ASSERT_TRUE(match_depths(T, ray_of(p), ray_of(T * p), &left, &right));
    EXPECT_NEAR(left, p.z(), 1e-6 * p.z());
    EXPECT_NEAR(right, (T * p).z(), 1e-6 * p.z());
  }
}

TEST(Epipolar, derivativesMatchCentralDifferences) {
  Random random(42);
  std::vector<Transform> transforms = {Transform{Mat3::Identity(), {-0.75, 0, 0}},
                                       Transform{exp_so3({0, 3.1, 0}), {0.1, 0.2, 5}}};
  for (int k = 0; k < 100; ++k) transforms.push_back(random_stereo(random));
  for (const Transform& T : transforms) {
    const Vec2 left(random.uniform(-0.6, 0.6), random.uniform(-0.4, 0.4));
    const Vec2 right(left.x() + random.uniform(-0.2, 0.1), left.y() + random.uniform(-0.05, 0.05));
    double value = 0;
    Vec5 J;
    for (const auto distance : {&EpipolarGeometry::sampson, &EpipolarGeometry::to_line}) {
      ASSERT_TRUE((EpipolarGeometry(T).*distance)(left, right, &value, &J));
      EXPECT_TRUE(test::jacobian_matches(
          J.transpose(),
          [&](const Vec5& d) {
            double v = 0;
            EXPECT_TRUE(
                (EpipolarGeometry(moved_on_sphere(T, d)).*distance)(left, right, &v, nullptr));
            return Value(v);
          },
          1e-7));
    }
  }
}

TEST(Epipolar, degenerateInputReturnsFalse) {
  double value = 7;
  EXPECT_FALSE(EpipolarGeometry(Transform{}).sampson({0, 0}, {0, 0}, &value, nullptr));
  const EpipolarGeometry forward(Transform{Mat3::Identity(), {0, 0, -1}});
  EXPECT_FALSE(forward.sampson({0, 0}, {0, 0}, &value, nullptr));
  EXPECT_FALSE(forward.to_line({0, 0}, {0.1, 0}, &value, nullptr));
  EXPECT_EQ(value, 7);
  double l = 3, r = 3;
  EXPECT_FALSE(match_depths(Transform{Mat3::Identity(), {1, 0, 0}}, {0.1, 0}, {0.1, 0}, &l, &r));
  EXPECT_EQ(l, 3);
}

// Likelihood of a calibration from distances to epipolar lines.

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
