#pragma once
#include "core/math/types.hpp"

/// Factorisations of small matrices, compiled once for the sizes listed in linear_solve.cpp: with
/// every file that uses them Eigen instantiates its blocked algorithms, which takes the compiler
/// seconds for each size.
///
/// Threads pure. Memory: the stack. Results are Eigen's, bit for bit.
namespace vergence {

template <int N>
using Square = Eigen::Matrix<double, N, N>;
template <int N>
using Column = Eigen::Matrix<double, N, 1>;

/// A = L Lᵀ of a symmetric matrix, of which the lower triangle is read.
template <int N>
class Cholesky {
 public:
  explicit Cholesky(const Square<N>& A) noexcept;
  /// False: A is not positive definite, and nothing else may be asked for.
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] Column<N> solve(const Column<N>& b) const noexcept;
  [[nodiscard]] Square<N> solve(const Square<N>& B) const noexcept;
  [[nodiscard]] Square<N> inverse() const noexcept {
    return solve(Square<N>(Square<N>::Identity()));
  }
  /// L⁻¹: makes what has the covariance A white.
  [[nodiscard]] Square<N> whitening() const noexcept;

 private:
  Square<N> L_;  // the upper triangle is A's
  bool ok_ = false;
};

/// x of A x = b by L D Lᵀ with pivoting; A symmetric positive semidefinite.
template <int N>
[[nodiscard]] Column<N> ldlt_solve(const Square<N>& A, const Column<N>& b) noexcept;

/// As above; returns whether the factorisation succeeded and A is positive semidefinite.
template <int N>
[[nodiscard]] bool ldlt_solve(const Square<N>& A, const Column<N>& b, Column<N>* x) noexcept;

/// A⁻¹ by L D Lᵀ; A symmetric positive definite.
template <int N>
[[nodiscard]] Square<N> ldlt_inverse(const Square<N>& A) noexcept;

/// X of A X = B by LU with partial pivoting; A invertible.
template <int N, int M>
[[nodiscard]] Eigen::Matrix<double, N, M> lu_solve(const Square<N>& A,
                                                   const Eigen::Matrix<double, N, M>& B) noexcept;

/// Eigenvalues of a symmetric positive semidefinite matrix, greatest first: its singular values.
template <int N>
[[nodiscard]] Column<N> semidefinite_eigenvalues(const Square<N>& m) noexcept;

/// Returns true if a symmetric matrix of any size is positive definite. Allocates.
[[nodiscard]] bool positive_definite(const Eigen::MatrixXd& A);

/// M = U diag(singular) Vᵀ, singular values greatest first.
struct Svd3 {
  Mat3 U, V;
  Vec3 singular;
};
[[nodiscard]] Svd3 svd(const Mat3& M) noexcept;

}  // namespace vergence
