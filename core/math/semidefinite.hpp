#pragma once
#include <Eigen/SVD>

namespace vergence {

/// Eigenvalues of a symmetric positive semidefinite matrix, greatest first: its singular values. As
/// exact as Eigen's eigensolver, which takes the compiler ten times as long for each size.
///
/// Threads pure. Memory: the stack.
template <class Matrix>
[[nodiscard]] auto semidefinite_eigenvalues(const Matrix& m) noexcept {
  return typename Eigen::JacobiSVD<Matrix>::SingularValuesType(
      Eigen::JacobiSVD<Matrix>(m).singularValues());
}

}  // namespace vergence
