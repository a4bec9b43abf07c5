#include "core/bundle/detail/shared_prior.hpp"

#include <cmath>

#include <Eigen/Cholesky>

#include "core/bundle/detail/setup.hpp"
#include "core/bundle/detail/system.hpp"
#include "core/math/so3.hpp"

namespace vergence::detail {
namespace {

using Index = Eigen::Index;
// Added to a unit variance, to keep covariances written with few digits positive definite.
constexpr double kRidge = 1e-9;

double combined_covariance(const RigCovariance& C, const Combination& a,
                           const Combination& b) noexcept {
  double sum = 0;
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      sum += a.factor[i] * b.factor[j] * C(a.first + i, b.first + j);
  return sum;
}

}  // namespace

Combination extrinsic_combination(const Mat6& basis, const Mat3& R, int k, int row) noexcept {
  Combination c;
  c.first = extrinsic_row(k);
  c.count = 6;
  const Vec3 tau = R * basis.block<3, 1>(0, row), phi = R * basis.block<3, 1>(3, row);
  for (int i = 0; i < 3; ++i) {
    c.factor[i] = phi[i];
    c.factor[3 + i] = tau[i];
  }
  return c;
}

SharedPrior::SharedPrior(const BundleSharedPrior& prior, const SharedLayout& layout,
                         std::size_t cameras) noexcept
    : layout_(layout), cameras_(cameras), weight_(prior.weight) {
  if (prior.rig == nullptr || layout.size == 0) return;
  Combination rows[kMaxShared];
  // Row in the layout; −1 if it has none.
  int place[kMaxShared];
  int n = 0;
  for (std::size_t k = 1; k < cameras; ++k) {
    const int number = static_cast<int>(k);
    const Transform& T = prior.rig->T_camera_left[k];
    if (!(T.t.norm() > 0)) return;
    if (layout.exact[k]) mean_[k].basis = tangent_basis((T.R.transpose() * T.t).normalized());
    const Mat6 basis = extrinsic_basis(layout, mean_[k], number);
    for (int i = 0; i < (layout.exact[k] ? 5 : 6); ++i) {
      rows[n] = extrinsic_combination(basis, T.R, number, i);
      // If the transform is unknown, so is the rest.
      if (!(combined_covariance(prior.rig->covariance, rows[n], rows[n]) > 0)) return;
      place[n++] = layout.extrinsic[k] + i;
    }
  }
  for (std::size_t k = 0; k < cameras; ++k)
    for (int i = 0; i < kIntrinsicsSize; ++i) {
      const int row = intrinsic_row(static_cast<int>(k)) + i;
      if (!prior.rig->covariance.known(row)) continue;
      rows[n].first = row;
      rows[n].count = 1;
      rows[n].factor[0] = 1;
      place[n] = -1;
      for (int j = 0; j < layout.intrinsic_count[k]; ++j)
        if (layout.intrinsic_index[k][j] == i) place[n] = layout.intrinsic[k] + j;
      ++n;
    }
  SharedMatrix C(n, n);
  SharedVector scale(n);
  for (int i = 0; i < n; ++i)
    scale[i] = 1.0 / std::sqrt(combined_covariance(prior.rig->covariance, rows[i], rows[i]));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j)
      C(i, j) = C(j, i) =
          scale[i] * scale[j] * combined_covariance(prior.rig->covariance, rows[i], rows[j]);
  C.diagonal().array() += kRidge;
  const Eigen::LLT<SharedMatrix> factor(C);
  if (factor.info() != Eigen::Success) return;
  const SharedMatrix inverse = factor.solve(SharedMatrix::Identity(n, n));
  if (!inverse.allFinite()) return;
  information_ = SharedMatrix::Zero(layout.size, layout.size);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      if (place[i] >= 0 && place[j] >= 0)
        information_(place[i], place[j]) = weight_ * scale[i] * scale[j] * inverse(i, j);
  rig_ = prior.rig;
}

SharedVector SharedPrior::residual(const BundleState& state) const noexcept {
  SharedVector d = SharedVector::Zero(layout_.size);
  for (std::size_t k = 1; k < cameras_; ++k) {
    const Transform &T0 = rig_->T_camera_left[k], &T = state.T_camera_left[k];
    Vec6 way;
    way << T0.R.transpose() * (T.t - T0.t), log_so3(T0.R.transpose() * T.R);
    const Vec6 own = extrinsic_basis(layout_, mean_[k], static_cast<int>(k)).transpose() * way;
    for (int i = 0; i < (layout_.exact[k] ? 5 : 6); ++i) d[layout_.extrinsic[k] + i] = own[i];
  }
  for (std::size_t k = 0; k < cameras_; ++k) {
    const auto now = parameters(state.cameras[k].intrinsics()),
               then = parameters(rig_->intrinsics[k]);
    for (int i = 0; i < layout_.intrinsic_count[k]; ++i) {
      const std::size_t parameter = layout_.intrinsic_index[k][i];
      d[layout_.intrinsic[k] + i] = now[parameter] - then[parameter];
    }
  }
  return d;
}

SharedMatrix SharedPrior::jacobian(const BundleState& state, const KernelJob& job) const noexcept {
  SharedMatrix J = SharedMatrix::Identity(layout_.size, layout_.size);
  for (std::size_t k = 1; k < cameras_; ++k) {
    const int number = static_cast<int>(k), size = layout_.exact[k] ? 5 : 6;
    Mat6 turn = Mat6::Identity();
    turn.topLeftCorner<3, 3>() = rig_->T_camera_left[k].R.transpose() * state.T_camera_left[k].R;
    const Mat6 own = extrinsic_basis(layout_, mean_[k], number).transpose() * turn *
                     extrinsic_basis(layout_, job.cameras[k], number);
    J.block(layout_.extrinsic[k], layout_.extrinsic[k], size, size) = own.topLeftCorner(size, size);
  }
  return J;
}

}  // namespace vergence::detail
