#include "core/math/linear_solve.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace vergence {

template <int N>
Cholesky<N>::Cholesky(const Square<N>& A) noexcept {
  const Eigen::LLT<Square<N>> llt(A);
  L_ = llt.matrixLLT();
  ok_ = llt.info() == Eigen::Success;
}

template <int N>
Column<N> Cholesky<N>::solve(const Column<N>& b) const noexcept {
  Column<N> x = b;
  L_.template triangularView<Eigen::Lower>().solveInPlace(x);
  L_.template triangularView<Eigen::Lower>().adjoint().solveInPlace(x);
  return x;
}

template <int N>
Square<N> Cholesky<N>::solve(const Square<N>& B) const noexcept {
  Square<N> X = B;
  L_.template triangularView<Eigen::Lower>().solveInPlace(X);
  L_.template triangularView<Eigen::Lower>().adjoint().solveInPlace(X);
  return X;
}

template <int N>
Square<N> Cholesky<N>::whitening() const noexcept {
  return L_.template triangularView<Eigen::Lower>().solve(Square<N>::Identity());
}

template <int N>
Column<N> ldlt_solve(const Square<N>& A, const Column<N>& b) noexcept {
  return A.ldlt().solve(b);
}

template <int N>
bool ldlt_solve(const Square<N>& A, const Column<N>& b, Column<N>* x) noexcept {
  const Eigen::LDLT<Square<N>> ldlt(A);
  if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return false;
  *x = ldlt.solve(b);
  return true;
}

template <int N>
Square<N> ldlt_inverse(const Square<N>& A) noexcept {
  return A.ldlt().solve(Square<N>::Identity());
}

template <int N, int M>
Eigen::Matrix<double, N, M> lu_solve(const Square<N>& A,
                                     const Eigen::Matrix<double, N, M>& B) noexcept {
  return A.partialPivLu().solve(B);
}

template <int N>
Column<N> semidefinite_eigenvalues(const Square<N>& m) noexcept {
  // This is as accurate as Eigen's eigensolver, which takes ten times as long to compile for each
  // size.
  return Eigen::JacobiSVD<Square<N>>(m).singularValues();
}

bool positive_definite(const Eigen::MatrixXd& A) { return A.llt().info() == Eigen::Success; }

Svd3 svd(const Mat3& M) noexcept {
  const Eigen::JacobiSVD<Mat3> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

template class Cholesky<3>;
template class Cholesky<5>;
template class Cholesky<6>;
template Column<5> ldlt_solve(const Square<5>&, const Column<5>&) noexcept;
template Column<6> ldlt_solve(const Square<6>&, const Column<6>&) noexcept;
template Column<13> ldlt_solve(const Square<13>&, const Column<13>&) noexcept;
template bool ldlt_solve(const Square<6>&, const Column<6>&, Column<6>*) noexcept;
template Square<6> ldlt_inverse(const Square<6>&) noexcept;
template Square<13> ldlt_inverse(const Square<13>&) noexcept;
template Square<5> lu_solve(const Square<5>&, const Square<5>&) noexcept;
template Column<13> lu_solve(const Square<13>&, const Column<13>&) noexcept;
template Column<2> semidefinite_eigenvalues(const Square<2>&) noexcept;
template Column<3> semidefinite_eigenvalues(const Square<3>&) noexcept;
template Column<5> semidefinite_eigenvalues(const Square<5>&) noexcept;
template Column<6> semidefinite_eigenvalues(const Square<6>&) noexcept;

}  // namespace vergence
