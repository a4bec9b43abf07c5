#include "core/bundle/detail/system.hpp"

#include <algorithm>
#include <cmath>

#include "core/bundle/detail/setup.hpp"

namespace vergence::detail {
namespace {

using Row6 = Eigen::Matrix<double, 6, 6>;

void row_major(const Mat3& R, double out[9]) noexcept {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out[3 * r + c] = R(r, c);
}

}  // namespace

Row6 extrinsic_basis(const SharedLayout& shared, const KernelCamera& camera, int k) noexcept {
  Row6 J = Row6::Zero();
  if (!shared.exact[k]) return Row6::Identity();
  J.topLeftCorner<3, 2>() = camera.basis;
  J.block<3, 3>(3, 2).setIdentity();
  // The sixth column stays empty.
  return J;
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
  job_.y_group = w_.y_group.data();
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
  job_.lenses = false;
  for (std::size_t k = 0; k < problem_.cameras.size(); ++k)
    job_.lenses = job_.lenses || problem_.cameras[k].intrinsics().has_distortion() ||
                  shared.intrinsic_count[k] > 0;
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
    std::copy(intrinsics.distortion.begin(), intrinsics.distortion.end(), c.distortion);
    c.max_radius2 = state.cameras[k].max_radius2();
    c.distorted = intrinsics.has_distortion();
    c.equidistant = intrinsics.kind == CameraModelKind::pinhole_equidistant;
    c.identity = T.R == Mat3::Identity() && T.t == Vec3::Zero();
    if (job_.shared.exact[k]) c.basis = tangent_basis((T.R.transpose() * T.t).normalized());
  }
  job_.points = state.points.data();
  job_.cost = job_.squared_px = job_.weighted = 0;
  job_.behind = false;
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
    job_.group_begin = w_.batches[b].block_begin;
    detail::linearise(job_, b, end);
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
  detail::evaluate(job_, 0, w_.batch_count);
  cost_ = job_.cost + prior_cost(state);
  return !job_.behind && std::isfinite(cost_) && std::isfinite(job_.squared_px);
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
