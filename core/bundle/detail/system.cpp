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
  job_.y_shared = w_.y_shared.data();
  job_.factors = w_.factors.data();
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

std::array<std::span<double>, 5> System::used(const BundleSums& sums) const noexcept {
  const std::size_t poses = problem_.T_left_world.size();
  const auto classes = static_cast<std::size_t>(job_.classes);
  const bool intrinsics =
      std::any_of(std::begin(job_.shared.intrinsic_count), std::end(job_.shared.intrinsic_count),
                  [](int count) { return count > 0; });
  return {sums.A.first(ld_ * rows_), sums.sums.first(poses * classes * kPoseSums * kBatch),
          sums.reduced.first(rows_ * kBatch),
          sums.intrinsic_sums.first(intrinsics ? poses * kMaxCameras * kIntrinsicsSize * 6 * kBatch
                                               : 0),
          sums.intrinsic_own.first(intrinsics ? sums.intrinsic_own.size() : 0)};
}

void System::linearise_part(KernelJob& job, const BundleSums& sums, std::size_t first,
                            std::size_t last) noexcept {
  for (const std::span<double> all : used(sums)) std::fill(all.begin(), all.end(), 0.0);
  job.y_group = sums.y_group.data();
  job.sums = sums.sums.data();
  job.intrinsic_sums = sums.intrinsic_sums.data();
  job.intrinsic_own = sums.intrinsic_own.data();
  job.reduced = sums.reduced.data();
  for (std::size_t b = first; b < last;) {
    std::size_t end = b + 1;
    while (end < last && w_.batches[end].group == w_.batches[b].group) ++end;
    job.group_begin = w_.batches[b].block_begin;
    detail::linearise(job, b, end);
    if (rows_ > 0) subtract_points(job, b, end, sums.A.data(), ld_);
    b = end;
  }
}

void System::linearise_halves() noexcept {
  // Time is spent on the blocks, so the batches are divided where half of them are.
  std::size_t middle = 0;
  while (middle < w_.batch_count && w_.batches[middle].block_end <= w_.block_count / 2) ++middle;
  KernelJob second = job_;
  auto here = [&]() noexcept { linearise_part(job_, w_, 0, middle); };
  auto there = [&]() noexcept { linearise_part(second, w_.second_half, middle, w_.batch_count); };
  w_.runner->run(TaskRef(here), TaskRef(there));
  const auto to = used(w_), from = used(w_.second_half);
  for (std::size_t k = 0; k < to.size(); ++k)
    for (std::size_t i = 0; i < to[k].size(); ++i) to[k][i] += from[k][i];
  job_.cost += second.cost;
  job_.squared_px += second.squared_px;
  job_.weighted += second.weighted;
  job_.behind = job_.behind || second.behind;
}

bool System::linearise(const BundleState& state, double damping) noexcept {
  prepare(state);
  job_.damping = damping;
  if (w_.runner == nullptr)
    linearise_part(job_, w_, 0, w_.batch_count);
  else
    linearise_halves();
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
