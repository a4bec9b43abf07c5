#pragma once
#include <gtest/gtest.h>

#include <Eigen/Core>

namespace vergence::test {

/// ∂f/∂δ at δ = 0 by central differences. f takes an Eigen vector of Cols numbers and returns one
/// of Rows.
///
/// With step h the truncation error is h²/6·|f‴| and the rounding error about ε·|f|/h: h = 1e-6
/// gives 1e-10 relative to |f| for functions of order one; functions measured in pixels (|f| ≈
/// 1000) are known to about 1e-7 px per unit.
template <int Rows, int Cols, class F>
[[nodiscard]] Eigen::Matrix<double, Rows, Cols> numeric_jacobian(const F& f, double step = 1e-6) {
  using Input = Eigen::Matrix<double, Cols, 1>;
  Eigen::Matrix<double, Rows, Cols> J;
  for (int i = 0; i < Cols; ++i) {
    const Input d = step * Input::Unit(i);
    const Eigen::Matrix<double, Rows, 1> ahead = f(d), behind = f(Input(-d));
    J.col(i) = (ahead - behind) / (2.0 * step);
  }
  return J;
}

/// Compares an analytic derivative with central differences at δ = 0, column by column, each within
/// `tolerance`·(1 + |column|). A failure prints both matrices and their difference:
///
///     EXPECT_TRUE(test::jacobian_matches(J, [&](const Vec3& d) { return project(p + d); },
///     1e-6));
template <class Derived, class F>
[[nodiscard]] testing::AssertionResult jacobian_matches(const Eigen::MatrixBase<Derived>& analytic,
                                                        const F& f, double tolerance,
                                                        double step = 1e-6) {
  constexpr int kRows = Derived::RowsAtCompileTime, kCols = Derived::ColsAtCompileTime;
  static_assert(kRows > 0 && kCols > 0, "sizes are in the type");
  const Eigen::Matrix<double, kRows, kCols> given = analytic;
  const Eigen::Matrix<double, kRows, kCols> numeric = numeric_jacobian<kRows, kCols>(f, step);
  for (int i = 0; i < kCols; ++i) {
    const double difference = (given.col(i) - numeric.col(i)).norm();
    if (!(difference <= tolerance * (1.0 + given.col(i).norm())))
      return testing::AssertionFailure()
             << "column " << i << " is off by " << difference << "\nanalytic\n"
             << given << "\nnumeric\n"
             << numeric << "\ndifference\n"
             << given - numeric;
  }
  return testing::AssertionSuccess();
}

}  // namespace vergence::test
