#include "core/geometry/five_point.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "core/geometry/epipolar.hpp"
#include "tests/support/no_allocations.hpp"
#include "tests/support/quantile.hpp"
#include "tests/unit/core/geometry/random_scene.hpp"

namespace vergence {
namespace {

struct Matches {
  Transform T_right_left;
  std::array<Vec2, 5> left, right;
};

Matches random_matches(Random& random) {
  Matches m;
  m.T_right_left = {exp_so3(test::random_vector(random, -0.3, 0.3)),
                    test::random_vector(random, -1, 1)};
  for (std::size_t i = 0; i < 5; ++i) {
    const Vec3 p = test::visible_point(random, 3, 20), q = m.T_right_left * p;
    m.left[i] = Vec2(p.x() / p.z(), p.y() / p.z());
    m.right[i] = Vec2(q.x() / q.z(), q.y() / q.z());
  }
  return m;
}

/// Distance to the nearest solution; both have Frobenius norm √2 and free sign.
double nearest(const FivePointSolutions& s, const Mat3& E) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < s.count; ++i) {
    const Mat3& F = s.E[static_cast<std::size_t>(i)];
    best = std::min({best, (F - E).norm(), (F + E).norm()});
  }
  return best;
}

TEST(FivePoint, randomMatchesGiveTheTrueMatrix) {
  Random random(51);
  constexpr int kProblems = 3000;
  std::vector<double> errors;
  int missed = 0;
  for (int k = 0; k < kProblems; ++k) {
    const Matches m = random_matches(random);
    const FivePointSolutions s = solve_five_point(m.left, m.right);
    const double error = nearest(s, essential_matrix(m.T_right_left));
    errors.push_back(error);
    missed += error < 1e-6 ? 0 : 1;
  }
  EXPECT_LT(vergence::test::quantile(errors, 0.5), 1e-12);
  EXPECT_LT(vergence::test::quantile(errors, 0.98), 1e-9);
  // One problem in thousands has two roots so close that no sign change lies between them.
  EXPECT_LE(missed, 3);
}

TEST(FivePoint, decompositionGivesTheTransform) {
  Random random(54);
  for (int k = 0; k < 1000; ++k) {
    const Matches m = random_matches(random);
    Transform T;
    const double baseline = m.T_right_left.t.norm();
    ASSERT_EQ(
        decompose_essential(-3.0 * essential_matrix(m.T_right_left), m.left, m.right, baseline, &T),
        5);
    EXPECT_LT(test::difference(T, m.T_right_left), 1e-9);
  }
}

TEST(FivePoint, degenerateInputHasNoSolution) {
  Random random(55);
  Matches m = random_matches(random);
  m.left[4] = m.left[0];
  m.right[4] = m.right[0];
  EXPECT_EQ(solve_five_point(m.left, m.right).count, 0);
  m = random_matches(random);
  m.right[2].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solve_five_point(m.left, m.right).count, 0);
  m = random_matches(random);
  m.left.fill(Vec2::Zero());
  m.right.fill(Vec2::Zero());
  EXPECT_EQ(solve_five_point(m.left, m.right).count, 0);
  Transform T;
  EXPECT_EQ(decompose_essential(Mat3::Constant(std::numeric_limits<double>::quiet_NaN()), m.left,
                                m.right, 1, &T),
            0);
  EXPECT_EQ(T.R, Mat3::Identity());
}

TEST(FivePoint, extremeInputIsFiniteWithoutAllocations) {
  Random random(56);
  for (int k = 0; k < 2000; ++k) {
    Matches m = random_matches(random);
    switch (random.below(4)) {
      case 0:
        m.right = m.left;
        // The points are at infinity without a rotation.
        break;
      case 1:
        // All points are on one line.
        for (std::size_t i = 0; i < 5; ++i) m.left[i].y() = m.right[i].y() = 0;
        break;
      case 2:
        // The points are at infinity with a rotation.
        for (std::size_t i = 0; i < 5; ++i) {
          const Vec3 q = m.T_right_left.R * m.left[i].homogeneous();
          m.right[i] = q.head<2>() / q.z();
        }
        break;
      default:
        m.left[3] = m.left[2] + Vec2(1e-9, 0);
    }
    test::expect_no_allocations([&] {
      const FivePointSolutions s = solve_five_point(m.left, m.right);
      for (int i = 0; i < s.count; ++i) {
        Transform T;
        (void)decompose_essential(s.E[static_cast<std::size_t>(i)], m.left, m.right, 1.0, &T);
        ASSERT_TRUE(s.E[static_cast<std::size_t>(i)].allFinite() && T.finite());
      }
    });
  }
}

}  // namespace
}  // namespace vergence
