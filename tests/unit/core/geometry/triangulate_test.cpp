#include "core/geometry/triangulate.hpp"

#include <Eigen/LU>
#include <array>
#include <limits>
#include <vector>

#include "tests/support/no_allocations.hpp"
#include "tests/unit/core/geometry/random_scene.hpp"

namespace vergence {
namespace {

// A third of a pixel at 500 px focal length.
constexpr double kSigma = 0.3 / 500;

/// Views of one world point from places a metre or so apart, looking roughly the same way.
std::vector<RayView> views_of(const Vec3& p_first, std::size_t n, double noise, Random& random,
                              Vec3* p_world) {
  const Transform T_first_world = test::random_transform(random, 2.0, 30.0);
  *p_world = T_first_world.inverse() * p_first;
  std::vector<RayView> views(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Transform T_view_first =
        i == 0 ? Transform{}
               : Transform{exp_so3(test::random_vector(random, -0.1, 0.1)),
                           test::random_vector(random, -1, 1) + Vec3(0.5, 0, 0)};
    const Vec3 q = T_view_first * p_first;
    views[i] = {
        T_view_first * T_first_world,
        Vec2(q.x() / q.z() + noise * random.normal(), q.y() / q.z() + noise * random.normal()),
        kSigma};
  }
  return views;
}

TEST(Triangulate, exactViewsGiveTheExactPoint) {
  Random random(31);
  for (int k = 0; k < 5000; ++k) {
    const Vec3 p = test::visible_point(random, 3, 30);
    Vec3 p_world;
    const std::vector<RayView> views = views_of(p, 2 + random.below(4), 0.0, random, &p_world);
    const TriangulatedPoint found = triangulate(views);
    // Two centres are nearly in line with the point.
    if (found.status == TriangulateStatus::no_parallax) continue;
    ASSERT_EQ(found.status, TriangulateStatus::ok);
    EXPECT_LT((found.p_world - p_world).norm(), 1e-9 * (1 + p_world.norm()));
    EXPECT_NEAR(found.inverse_depth, 1 / p.z(), 1e-9);
  }
}

TEST(Triangulate, inverseDepthSigmaMatchesTheErrors) {
  Random random(32);
  double squares = 0;
  constexpr int kRuns = 3000;
  for (int k = 0; k < kRuns; ++k) {
    const Vec3 p = test::visible_point(random, 3, 8);
    Vec3 p_world;
    std::vector<RayView> views = views_of(p, 4, kSigma, random, &p_world);
    const TriangulatedPoint found = triangulate(views);
    ASSERT_TRUE(found.status == TriangulateStatus::ok ||
                found.status == TriangulateStatus::no_parallax);
    const double off = (found.inverse_depth - 1 / p.z()) / found.inverse_depth_sigma;
    squares += off * off / kRuns;
  }
  // The standard error is √(2/3000) = 0.026.
  EXPECT_NEAR(squares, 1.0, 0.1);
}

TEST(Triangulate, pointAtInfinityKeepsItsDirection) {
  const std::array<RayView, 2> views = {
      RayView{Transform{}, Vec2(0.1, -0.05), kSigma},
      RayView{{Mat3::Identity(), {-0.5, 0, 0}}, Vec2(0.1, -0.05), kSigma}};
  const TriangulatedPoint found = triangulate(views);
  EXPECT_EQ(found.status, TriangulateStatus::no_parallax);
  EXPECT_NEAR(found.inverse_depth, 0.0, 1e-12);
  // The expected sigma is the disparity's sigma over the baseline.
  EXPECT_NEAR(found.inverse_depth_sigma, std::sqrt(2.0) * kSigma / 0.5, 1e-6);
  EXPECT_LT((found.p_world / found.p_world.z() - Vec3(0.1, -0.05, 1)).norm(), 1e-9);
  EXPECT_GT(found.p_world.z(), 100.0);
}

TEST(Triangulate, degenerateViewsGiveTheirStatus) {
  const Transform right{Mat3::Identity(), {-0.5, 0, 0}};
  std::array<RayView, 2> views = {RayView{Transform{}, Vec2(0.0, 0.0), kSigma},
                                  RayView{right, Vec2(0.1, 0.0), kSigma}};
  // The pair has the disparity of swapped images.
  EXPECT_EQ(triangulate(views).status, TriangulateStatus::behind);
  views[1] = {Transform{}, Vec2(0.0, 0.0), kSigma};
  EXPECT_EQ(triangulate(views).status, TriangulateStatus::no_baseline);
  // The camera drives straight at the point.
  views[1] = {{Mat3::Identity(), {0, 0, -1}}, Vec2(0.0, 0.0), kSigma};
  EXPECT_EQ(triangulate(views).status, TriangulateStatus::no_baseline);
  views[1] = {right, Vec2(-0.05, 0.0), 0.0};
  EXPECT_EQ(triangulate(views).status, TriangulateStatus::invalid_input);
  views[1] = {right, Vec2(std::numeric_limits<double>::quiet_NaN(), 0.0), kSigma};
  EXPECT_EQ(triangulate(views).status, TriangulateStatus::invalid_input);
  EXPECT_EQ(triangulate(std::span<const RayView>(views).first(1)).status,
            TriangulateStatus::invalid_input);
  EXPECT_EQ(triangulate({}).status, TriangulateStatus::invalid_input);
}

TEST(Triangulate, extremeViewsAreFiniteWithoutAllocations) {
  Random random(33);
  for (int k = 0; k < 5000; ++k) {
    std::array<RayView, 3> views;
    for (RayView& v : views)
      v = {test::random_transform(random, 3, std::pow(10, random.uniform(-8, 4))),
           Vec2(random.uniform(-3, 3), random.uniform(-3, 3)), kSigma};
    test::expect_no_allocations([&] {
      const TriangulatedPoint found = triangulate(views);
      ASSERT_TRUE(found.p_world.allFinite() && std::isfinite(found.inverse_depth_sigma));
    });
  }
}

}  // namespace
}  // namespace vergence
