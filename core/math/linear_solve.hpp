#pragma once
#include "core/math/types.hpp"

/// Factorisations of small matrices, compiled once for the sizes listed in linear_solve.cpp,
/// because instantiating Eigen's blocked algorithms in every file takes seconds for each size.
///
/// Pure. Results are Eigen's, bit for bit.
namespace vergence {

template <int N>
using Square = Eigen::Matrix<double, N, N>;
template <int N>
using Column = Eigen::Matrix<double, N, 1>;

/// Factorisation A = L Lᵀ of a symmetric matrix; only the lower triangle is read.
template <int N>
class Cholesky {
 public:
  explicit Cholesky(const Square<N>& A) noexcept;
  /// False if A is not positive definite; no other function may be called then.
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] Column<N> solve(const Column<N>& b) const noexcept;
  [[nodiscard]] Square<N> solve(const Square<N>& B) const noexcept;
  [[nodiscard]] Square<N> inverse() const noexcept {
    return solve(Square<N>(Square<N>::Identity()));
  }
  /// L⁻¹, which whitens vectors with covariance A.
  [[nodiscard]] Square<N> whitening() const noexcept;

 private:
  // The upper triangle is that of A.
  Square<N> L_;
  bool ok_ = false;
};

/// Solves A x = b by L D Lᵀ with pivoting; A symmetric positive semidefinite.
template <int N>
[[nodiscard]] Column<N> ldlt_solve(const Square<N>& A, const Column<N>& b) noexcept;

/// Same; returns true if the factorisation succeeded and A is positive semidefinite.
template <int N>
[[nodiscard]] bool ldlt_solve(const Square<N>& A, const Column<N>& b, Column<N>* x) noexcept;

/// Computes A⁻¹ by L D Lᵀ; A symmetric positive definite.
template <int N>
[[nodiscard]] Square<N> ldlt_inverse(const Square<N>& A) noexcept;

/// Solves A X = B by LU with partial pivoting; A invertible.
template <int N, int M>
[[nodiscard]] Eigen::Matrix<double, N, M> lu_solve(const Square<N>& A,
                                                   const Eigen::Matrix<double, N, M>& B) noexcept;

/// Eigenvalues of a symmetric positive semidefinite matrix, largest first, as its singular values.
template <int N>
[[nodiscard]] Column<N> semidefinite_eigenvalues(const Square<N>& m) noexcept;

/// Returns true if a symmetric matrix of any size is positive definite. Allocates.
[[nodiscard]] bool positive_definite(const Eigen::MatrixXd& A);

/// M = U diag(singular) Vᵀ with singular values in descending order.
struct Svd3 {
  Mat3 U, V;
  Vec3 singular;
};
[[nodiscard]] Svd3 svd(const Mat3& M) noexcept;

}  // namespace vergence
