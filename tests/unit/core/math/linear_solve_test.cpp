#include "core/math/linear_solve.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

/// A = M Mᵀ + 1, from a fixed M: positive definite, condition below 1e3.
template <int N>
Square<N> definite() {
  Square<N> M;
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) M(i, j) = static_cast<double>((3 * i + 7 * j + i * j) % 11) / 11.0;
  return M * M.transpose() + Square<N>::Identity();
}

// Some hundred ulps of entries below 10 with a condition below 1e3.
constexpr double kRounding = 1e-12;

TEST(LinearSolve, choleskySolvesInvertsAndWhitens) {
  const Mat6 A = definite<6>();
  const Cholesky<6> factor(A);
  ASSERT_TRUE(factor.ok());
  const Vec6 b = Vec6::LinSpaced(-1, 2);
  EXPECT_LT((A * factor.solve(b) - b).norm(), kRounding);
  EXPECT_LT((A * factor.inverse() - Mat6::Identity()).norm(), kRounding);
  const Mat6 W = factor.whitening();
  EXPECT_LT((W * A * W.transpose() - Mat6::Identity()).norm(), kRounding);
  EXPECT_FALSE(Cholesky<6>(-A).ok());
}

TEST(LinearSolve, ldltAndLuSolve) {
  const Mat6 A = definite<6>();
  const Vec6 b = Vec6::LinSpaced(-1, 2);
  Vec6 x;
  ASSERT_TRUE(ldlt_solve(A, b, &x));
  EXPECT_LT((A * x - b).norm(), kRounding);
  EXPECT_EQ(ldlt_solve(A, b), x);
  EXPECT_FALSE(ldlt_solve(Mat6(-A), b, &x));
  EXPECT_LT((A * ldlt_inverse(A) - Mat6::Identity()).norm(), kRounding);
  const Square<5> B = definite<5>(), C = Square<5>::Identity();
  EXPECT_LT((B * lu_solve(B, C) - C).norm(), kRounding);
  EXPECT_TRUE(positive_definite(A));
  EXPECT_FALSE(positive_definite(-A));
}

TEST(LinearSolve, singularValuesAreInDescendingOrder) {
  const Mat3 M = definite<3>();
  const Svd3 s = svd(M);
  EXPECT_LT((s.U * s.singular.asDiagonal() * s.V.transpose() - M).norm(), kRounding);
  EXPECT_GE(s.singular[0], s.singular[1]);
  EXPECT_GE(s.singular[1], s.singular[2]);
  EXPECT_LT((semidefinite_eigenvalues(M) - s.singular).norm(), kRounding);
}

}  // namespace
}  // namespace vergence
