#include "core/bundle/detail/system.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <Eigen/LU>

#include "core/bundle/detail/setup.hpp"

namespace vergence::detail {
namespace {

using Row6 = Eigen::Matrix<double, 6, 6>;

void row_major(const Mat3& R, double out[9]) noexcept {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out[3 * r + c] = R(r, c);
}

double lane_sum(const double* lanes) noexcept {
  double s = 0;
  for (int i = 0; i < kBatch; ++i) s += lanes[i];
  return s;
}

/// Symmetric 6×6 in (τ, φ) and gradient from one pose's sums.
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

/// The prior's δ = (φ, τ) at T, and how it moves with the pose's own (τ, φ): ∂δ/∂(τ, φ).
void prior_residual(const BundlePosePrior& prior, const Transform& T, Vec6* delta,
                    Mat6* J) noexcept {
  const Mat3 turn = T.R * prior.T_left_world.R.transpose();
  const Vec3 phi = log_so3(turn);
  const Vec3 tau = T.t - turn * prior.T_left_world.t;
  *delta << phi, tau;
  J->setZero();
  J->topRightCorner<3, 3>() = left_jacobian_so3(phi).inverse();
  J->bottomLeftCorner<3, 3>().setIdentity();
  J->bottomRightCorner<3, 3>() = -skew(tau);
}

}  // namespace

void tangent_basis(const Vec3& u, double basis[6]) noexcept {
  int least = 0;
  (void)u.cwiseAbs().minCoeff(&least);
  const Vec3 a = u.cross(Vec3::Unit(least)).normalized();
  const Vec3 b = u.cross(a);
  for (int r = 0; r < 3; ++r) {
    basis[2 * r] = a[r];
    basis[2 * r + 1] = b[r];
  }
}

Row6 extrinsic_basis(const SharedLayout& shared, const KernelCamera& camera, int k) noexcept {
  Row6 J = Row6::Zero();
  if (!shared.exact[k]) return Row6::Identity();
  for (int r = 0; r < 3; ++r) {
    J(r, 0) = camera.basis[2 * r];
    J(r, 1) = camera.basis[2 * r + 1];
    J(3 + r, 2 + r) = 1;
  }
  return J;  // the sixth column stays empty
}

System::System(BundleWorkspace& workspace, const BundleProblem& problem,
               const BundleOptions& options) noexcept
    : w_(workspace), problem_(problem), options_(options) {
  job_.batches = w_.batches.data();
  job_.blocks = w_.blocks.data();
  job_.slots = w_.slots.data();
  job_.poses = w_.poses.data();
  job_.point_free = w_.point_free.data();
  job_.y = w_.y.data();
  job_.y_shared = w_.y_shared.data();
  job_.factors = w_.factors.data();
  job_.sums = w_.sums.data();
  job_.intrinsic_sums = w_.intrinsic_sums.data();
  job_.intrinsic_own = w_.intrinsic_own.data();
  job_.reduced = w_.reduced.data();
  job_.loss = options.loss;
  job_.threshold2 = options.loss_threshold * options.loss_threshold;
  job_.free_poses = w_.free_poses;
  use(shared_layout(problem, options, false));
}

void System::use(const SharedLayout& shared) noexcept {
  job_.shared = shared;
  shared_prior_ = options_.configuration == BundleConfiguration::stereo_calibration
                      ? SharedPrior(options_.shared_prior, shared, problem_.cameras.size())
                      : SharedPrior();
  first_shared_ = static_cast<std::size_t>(w_.free_poses) * kBlock;
  rows_ = first_shared_ + static_cast<std::size_t>(shared.blocks) * kBlock;
  ld_ = (rows_ + kBatch - 1) / kBatch * kBatch;
  use_jets_ = false;
  for (std::size_t k = 0; k < problem_.cameras.size(); ++k)
    use_jets_ = use_jets_ || problem_.cameras[k].intrinsics().has_distortion() ||
                shared.intrinsic_count[k] > 0;
  job_.jets = use_jets_ ? w_.jets.data() : nullptr;
  const bool calibration = options_.configuration == BundleConfiguration::stereo_calibration;
  job_.classes = calibration ? static_cast<int>(problem_.cameras.size()) : 1;
  for (int k = 0; k < kMaxCameras; ++k)
    job_.class_cameras[k] =
        static_cast<std::uint8_t>(calibration ? 1U << static_cast<unsigned>(k) : 0xFFU);
}

void System::prepare(const BundleState& state) noexcept {
  for (std::size_t i = 0; i < problem_.T_left_world.size(); ++i) {
    row_major(state.poses[i].R, w_.poses[i].R);
    Eigen::Map<Vec3>(w_.poses[i].t) = state.poses[i].t;
  }
  for (std::size_t k = 0; k < problem_.cameras.size(); ++k) {
    KernelCamera& c = job_.cameras[k];
    const Transform& T = state.T_camera_left[k];
    row_major(T.R, c.R);
    Eigen::Map<Vec3>(c.t) = T.t;
    const Intrinsics& intrinsics = state.cameras[k].intrinsics();
    c.fx = intrinsics.fx;
    c.fy = intrinsics.fy;
    c.cx = intrinsics.cx;
    c.cy = intrinsics.cy;
    c.identity = T.R == Mat3::Identity() && T.t == Vec3::Zero();
    if (job_.shared.exact[k]) tangent_basis((T.R.transpose() * T.t).normalized(), c.basis);
  }
  job_.points = state.points.data();
  job_.cost = job_.squared_px = job_.weighted = job_.decrement = 0;
  job_.behind = false;
}

void System::fill_jets(const BundleState& state, const Batch& batch) noexcept {
  double* jet = w_.jets.data();
  const auto batch_index = static_cast<std::size_t>(&batch - w_.batches.data());
  for (std::uint32_t b = batch.block_begin; b < batch.block_end; ++b) {
    const PoseBlock& block = w_.blocks[b];
    std::size_t slot = block.slot;
    for (unsigned mask = block.cameras; mask != 0;
         mask &= mask - 1, ++slot, jet += kJetRows * kBatch) {
      const auto k = static_cast<std::size_t>(std::countr_zero(mask));
      const Camera& camera = state.cameras[k];
      for (std::size_t lane = 0; lane < kBatch; ++lane) {
        const auto put = [&](int row, double value) {
          jet[static_cast<std::size_t>(row) * kBatch + lane] = value;
        };
        for (int row = 0; row < kJetRows; ++row) put(row, 0.0);
        put(kJetDepth, kFar);
        const Slot& s = w_.slots[slot];
        if (!(s.inverse_sigma[lane] > 0)) continue;
        const auto coordinate = [&](std::size_t c) {
          return state.points[(batch_index * 3 + c) * kBatch + lane];
        };
        const Vec3 p = state.T_camera_left[k] * (state.poses[block.pose] *
                                                 Vec3(coordinate(0), coordinate(1), coordinate(2)));
        Vec2 pixel;
        Mat23 G;
        if (camera.project(p, &pixel, &G) != ProjectStatus::ok) {
          job_.behind = true;
          continue;
        }
        for (int i = 0; i < 6; ++i) put(i, G(i / 3, i % 3));
        put(6, s.x[lane] - pixel.x());
        put(7, s.y[lane] - pixel.y());
        put(kJetDepth, p.z());
        if (job_.shared.intrinsic_count[k] == 0) continue;
        const auto J = camera.intrinsics_jacobian(p);
        for (int i = 0; i < kIntrinsicsSize; ++i) {
          put(kJetIntrinsics + 2 * i, J(0, i));
          put(kJetIntrinsics + 2 * i + 1, J(1, i));
        }
      }
    }
  }
}

bool System::linearise(const BundleState& state, double damping) noexcept {
  prepare(state);
  job_.damping = damping;
  std::fill_n(w_.A.begin(), ld_ * rows_, 0.0);
  std::fill_n(
      w_.sums.begin(),
      problem_.T_left_world.size() * static_cast<std::size_t>(job_.classes) * kPoseSums * kBatch,
      0.0);
  std::fill_n(w_.reduced.begin(), rows_ * kBatch, 0.0);
  bool any_intrinsics = false;
  for (const int count : job_.shared.intrinsic_count) any_intrinsics = any_intrinsics || count > 0;
  if (any_intrinsics) {
    std::fill_n(w_.intrinsic_sums.begin(),
                problem_.T_left_world.size() * kMaxCameras * kIntrinsicsSize * 6 * kBatch, 0.0);
    std::fill(w_.intrinsic_own.begin(), w_.intrinsic_own.end(), 0.0);
  }
  for (std::size_t b = 0; b < w_.batch_count;) {
    std::size_t end = b + 1;
    while (end < w_.batch_count && w_.batches[end].group == w_.batches[b].group) ++end;
    if (use_jets_) {
      for (std::size_t i = b; i < end; ++i) {
        fill_jets(state, w_.batches[i]);
        detail::linearise(job_, i, i + 1);
      }
    } else {
      detail::linearise(job_, b, end);
    }
    if (rows_ > 0) subtract_points(job_, b, end, w_.A.data(), ld_);
    b = end;
  }
  cost_ = job_.cost + prior_cost(state);
  if (job_.behind || !std::isfinite(cost_) || !std::isfinite(job_.squared_px)) return false;
  assemble(state);
  return true;
}

bool System::evaluate(const BundleState& state, bool squared) noexcept {
  prepare(state);
  job_.squared = squared ? w_.squared.data() : nullptr;
  if (use_jets_) {
    for (std::size_t i = 0; i < w_.batch_count; ++i) {
      fill_jets(state, w_.batches[i]);
      detail::evaluate(job_, i, i + 1);
    }
  } else {
    detail::evaluate(job_, 0, w_.batch_count);
  }
  cost_ = job_.cost + prior_cost(state);
  return !job_.behind && std::isfinite(cost_) && std::isfinite(job_.squared_px);
}

/// Undamped information: the diagonal grows by (1 + λ).
void System::add_information(std::size_t row, std::size_t column, double value) noexcept {
  at(row, column) += row == column ? value * (1.0 + job_.damping) : value;
}

void System::assemble(const BundleState& state) noexcept {
  for (std::size_t i = 0; i < rows_; ++i) w_.rhs[i] = -lane_sum(w_.reduced.data() + i * kBatch);
  for (std::size_t i = 0; i < problem_.T_left_world.size(); ++i) assemble_pose(i);
  assemble_intrinsics();
  add_priors(state);
  for (std::size_t i = first_shared_ + static_cast<std::size_t>(job_.shared.size); i < rows_;
       ++i) {  // padding
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
  for (const BundlePosePrior& prior : problem_.pose_priors) {
    const std::int32_t block = w_.poses[prior.pose].block;
    if (block < 0) continue;
    Vec6 delta;
    Mat6 J;
    prior_residual(prior, state.poses[prior.pose], &delta, &J);
    const Mat6 H = J.transpose() * prior.information * J;
    const Vec6 e = -J.transpose() * (prior.information * delta);
    const auto first = static_cast<std::size_t>(block) * kBlock;
    for (std::size_t r = 0; r < kBlock; ++r) {
      w_.rhs[first + r] += e[static_cast<Eigen::Index>(r)];
      for (std::size_t c = 0; c <= r; ++c)
        add_information(first + r, first + c,
                        H(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)));
    }
  }
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
  for (const BundlePosePrior& prior : problem_.pose_priors) {
    if (w_.poses[prior.pose].block < 0) continue;
    Vec6 delta;
    Mat6 J;
    prior_residual(prior, state.poses[prior.pose], &delta, &J);
    cost += 0.5 * delta.dot(prior.information * delta);
  }
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

void System::move(const BundleState& state, const double* delta, BundleState* candidate) noexcept {
  update_ = norm_ = 0;
  for (std::size_t i = 0; i < rows_; ++i) update_ += delta[i] * delta[i];
  for (std::size_t i = 0; i < problem_.T_left_world.size(); ++i) {
    candidate->poses[i] = state.poses[i];
    norm_ += state.poses[i].t.squaredNorm();
    if (w_.poses[i].block < 0) continue;
    const double* d = delta + w_.poses[i].block * kBlock;
    const Mat3 turn = exp_so3({d[3], d[4], d[5]});
    candidate->poses[i] = {normalised(turn * state.poses[i].R),
                           turn * state.poses[i].t + Vec3(d[0], d[1], d[2])};
  }
  const double* shared = delta + first_shared_;
  for (std::size_t k = 0; k < problem_.cameras.size(); ++k) {
    candidate->T_camera_left[k] = state.T_camera_left[k];
    candidate->cameras[k] = state.cameras[k];
    if (job_.shared.extrinsic[k] >= 0) {
      Vec6 rows = Vec6::Zero();
      for (int i = 0; i < (job_.shared.exact[k] ? 5 : 6); ++i)
        rows[i] = shared[job_.shared.extrinsic[k] + i];
      const Vec6 step = extrinsic_basis(job_.shared, job_.cameras[k], static_cast<int>(k)) * rows;
      const Transform& T = state.T_camera_left[k];
      Vec3 t = T.t + T.R * step.head<3>();
      if (job_.shared.exact[k]) t *= T.t.norm() / t.norm();
      candidate->T_camera_left[k] = {normalised(T.R * exp_so3(step.tail<3>())), t};
    }
    if (job_.shared.intrinsic_count[k] > 0) {
      Intrinsics intrinsics = state.cameras[k].intrinsics();
      auto values = parameters(intrinsics);
      for (int i = 0; i < job_.shared.intrinsic_count[k]; ++i)
        values[job_.shared.intrinsic_index[k][i]] += shared[job_.shared.intrinsic[k] + i];
      set_parameters(intrinsics, values);
      candidate->cameras[k] = Camera(intrinsics);
    }
  }
  job_.points = state.points.data();
  job_.candidate = candidate->points.data();
  job_.update = job_.norm = 0;
  back_substitute(job_, 0, w_.batch_count, delta);
  update_ += job_.update;
  norm_ += job_.norm;
}

}  // namespace vergence::detail
