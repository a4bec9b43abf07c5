#include <cstddef>
#include <cstdint>

#include <Eigen/LU>

#include "core/bundle/detail/setup.hpp"
#include "core/bundle/detail/system.hpp"
#include "core/math/so3.hpp"

/// Assembly of the reduced system from the kernels' sums and the priors.
namespace vergence::detail {
namespace {

using Row6 = Eigen::Matrix<double, 6, 6>;

double lane_sum(const double* lanes) noexcept {
  double s = 0;
  for (int i = 0; i < kBatch; ++i) s += lanes[i];
  return s;
}

/// Unpacks the symmetric 6×6 in (τ, φ) and the gradient from one pose's sums.
void unpack(const double* sums, Mat6* H, Vec6* e) noexcept {
  double s[kPoseSums];
  for (int i = 0; i < kPoseSums; ++i) s[i] = lane_sum(sums + i * kBatch);
  const double* tt = s;
  const double* ft = s + 6;
  const double* ff = s + 15;
  H->topLeftCorner<3, 3>() << tt[0], tt[1], tt[2], tt[1], tt[3], tt[4], tt[2], tt[4], tt[5];
  H->bottomLeftCorner<3, 3>() << ft[0], ft[1], ft[2], ft[3], ft[4], ft[5], ft[6], ft[7], ft[8];
  H->topRightCorner<3, 3>() = H->bottomLeftCorner<3, 3>().transpose();
  H->bottomRightCorner<3, 3>() << ff[0], ff[1], ff[2], ff[1], ff[3], ff[4], ff[2], ff[4], ff[5];
  for (int i = 0; i < 6; ++i) (*e)[i] = s[21 + i];
}

}  // namespace

/// Adds undamped information; its diagonal is multiplied by 1 + λ.
void System::add_information(std::size_t row, std::size_t column, double value) noexcept {
  at(row, column) += row == column ? value * (1.0 + job_.damping) : value;
}

void System::assemble(const BundleState& state) noexcept {
  for (std::size_t i = 0; i < rows_; ++i) w_.rhs[i] = -lane_sum(w_.reduced.data() + i * kBatch);
  for (std::size_t i = 0; i < problem_.T_left_world.size(); ++i) assemble_pose(i);
  assemble_intrinsics();
  add_priors(state);
  for (std::size_t i = first_shared_ + static_cast<std::size_t>(job_.shared.size); i < rows_;
       // Padding rows.
       ++i) {
    at(i, i) = 1;
    w_.rhs[i] = 0;
  }
}

void System::assemble_pose(std::size_t pose) noexcept {
  const std::int32_t block = w_.poses[pose].block;
  Mat6 all = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  for (int k = 0; k < job_.classes; ++k) {
    if (k == 0 && block < 0) continue;
    Mat6 H;
    Vec6 e;
    unpack(w_.sums.data() +
               (pose * static_cast<std::size_t>(job_.classes) + static_cast<std::size_t>(k)) *
                   kPoseSums * kBatch,
           &H, &e);
    all += H;
    gradient += e;
    if (k == 0) continue;
    const Row6 J = extrinsic_basis(job_.shared, job_.cameras[k], k);
    const Mat6 JtH = J.transpose() * H, own = JtH * J;
    const Vec6 g = J.transpose() * e;
    const std::size_t first = first_shared_ + static_cast<std::size_t>(job_.shared.extrinsic[k]);
    const int size = job_.shared.exact[k] ? 5 : 6;
    for (int r = 0; r < size; ++r) {
      const std::size_t row = first + static_cast<std::size_t>(r);
      w_.rhs[row] += g[r];
      for (int c = 0; c <= r; ++c)
        add_information(row, first + static_cast<std::size_t>(c), own(r, c));
      if (block < 0) continue;
      for (int c = 0; c < kBlock; ++c)
        at(row, static_cast<std::size_t>(block * kBlock + c)) += JtH(r, c);
    }
  }
  if (block < 0) return;
  const auto first = static_cast<std::size_t>(block) * kBlock;
  for (std::size_t r = 0; r < kBlock; ++r) {
    w_.rhs[first + r] += gradient[static_cast<Eigen::Index>(r)];
    for (std::size_t c = 0; c <= r; ++c)
      add_information(first + r, first + c,
                      all(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)));
  }
}

void System::assemble_intrinsics() noexcept {
  for (std::size_t k = 0; k < problem_.cameras.size(); ++k) {
    const int count = job_.shared.intrinsic_count[k];
    if (count == 0) continue;
    const std::size_t first = first_shared_ + static_cast<std::size_t>(job_.shared.intrinsic[k]);
    for (int i = 0; i < count; ++i) {
      const std::size_t row = first + static_cast<std::size_t>(i);
      const double* own =
          w_.intrinsic_own.data() +
          (k * kIntrinsicsSize + static_cast<std::size_t>(i)) * (kIntrinsicsSize + 1) * kBatch;
      for (int c = 0; c <= i; ++c)
        add_information(row, first + static_cast<std::size_t>(c), lane_sum(own + c * kBatch));
      w_.rhs[row] += lane_sum(own + kIntrinsicsSize * kBatch);
      Vec6 with_extrinsic = Vec6::Zero();
      for (std::size_t pose = 0; pose < problem_.T_left_world.size(); ++pose) {
        const double* sums =
            w_.intrinsic_sums.data() +
            ((pose * kMaxCameras + k) * kIntrinsicsSize + static_cast<std::size_t>(i)) * 6 * kBatch;
        Vec6 v;
        for (int c = 0; c < 6; ++c) v[c] = lane_sum(sums + c * kBatch);
        with_extrinsic += v;
        const std::int32_t block = w_.poses[pose].block;
        if (block < 0) continue;
        for (int c = 0; c < 6; ++c) at(row, static_cast<std::size_t>(block * kBlock + c)) += v[c];
      }
      if (job_.shared.extrinsic[k] < 0) continue;
      const Vec6 v =
          extrinsic_basis(job_.shared, job_.cameras[k], static_cast<int>(k)).transpose() *
          with_extrinsic;
      for (int c = 0; c < (job_.shared.exact[k] ? 5 : 6); ++c)
        at(row, first_shared_ + static_cast<std::size_t>(job_.shared.extrinsic[k] + c)) += v[c];
    }
  }
}

void System::add_priors(const BundleState& state) noexcept {
  for (std::size_t k = 0; k < problem_.cameras.size(); ++k) {
    const SharedLayout& s = job_.shared;
    if (s.extrinsic[k] >= 0 && options_.length[k].kind == BundleLength::measured) {
      const Transform& T = state.T_camera_left[k];
      const Vec3 j = T.R.transpose() * T.t.normalized();
      const double information = 1.0 / (options_.length[k].sigma * options_.length[k].sigma),
                   miss = options_.length[k].metres - T.t.norm();
      const std::size_t first = first_shared_ + static_cast<std::size_t>(s.extrinsic[k]);
      for (std::size_t r = 0; r < 3; ++r) {
        const double jr = j[static_cast<Eigen::Index>(r)];
        w_.rhs[first + r] += jr * miss * information;
        for (std::size_t c = 0; c <= r; ++c)
          add_information(first + r, first + c, jr * j[static_cast<Eigen::Index>(c)] * information);
      }
    }
    const auto values = parameters(state.cameras[k].intrinsics());
    for (int i = 0; i < s.intrinsic_count[k]; ++i) {
      const std::size_t parameter = s.intrinsic_index[k][i];
      const BundleIntrinsics& given = options_.intrinsics[k];
      if (((given.free >> parameter) & 1U) == 0 || !(given.prior_sigma[parameter] > 0)) continue;
      const double information =
          1.0 / (given.prior_sigma[parameter] * given.prior_sigma[parameter]);
      const std::size_t row = first_shared_ + static_cast<std::size_t>(s.intrinsic[k] + i);
      w_.rhs[row] += information * (given.prior_mean[parameter] - values[parameter]);
      add_information(row, row, information);
    }
  }
  if (!shared_prior_.used()) return;
  const SharedMatrix J = shared_prior_.jacobian(state, job_);
  const SharedMatrix JtL = J.transpose().lazyProduct(shared_prior_.information());
  const SharedMatrix H = JtL.lazyProduct(J);
  const SharedVector e = JtL.lazyProduct(shared_prior_.residual(state));
  for (int r = 0; r < job_.shared.size; ++r) {
    const std::size_t row = first_shared_ + static_cast<std::size_t>(r);
    w_.rhs[row] -= e[r];
    for (int c = 0; c <= r; ++c)
      add_information(row, first_shared_ + static_cast<std::size_t>(c), H(r, c));
  }
}

double System::prior_cost(const BundleState& state) const noexcept {
  double cost = 0;
  for (std::size_t k = 0; k < problem_.cameras.size(); ++k) {
    if (job_.shared.extrinsic[k] >= 0 && options_.length[k].kind == BundleLength::measured) {
      const double r =
          (options_.length[k].metres - state.T_camera_left[k].t.norm()) / options_.length[k].sigma;
      cost += 0.5 * r * r;
    }
    const auto values = parameters(state.cameras[k].intrinsics());
    for (int i = 0; i < job_.shared.intrinsic_count[k]; ++i) {
      const std::size_t parameter = job_.shared.intrinsic_index[k][i];
      const BundleIntrinsics& given = options_.intrinsics[k];
      if (((given.free >> parameter) & 1U) == 0 || !(given.prior_sigma[parameter] > 0)) continue;
      const double r =
          (given.prior_mean[parameter] - values[parameter]) / given.prior_sigma[parameter];
      cost += 0.5 * r * r;
    }
  }
  if (shared_prior_.used()) {
    const SharedVector d = shared_prior_.residual(state);
    cost += 0.5 * d.dot(SharedVector(shared_prior_.information().lazyProduct(d)));
  }
  return cost;
}

}  // namespace vergence::detail
