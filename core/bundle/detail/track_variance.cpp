#include "core/bundle/detail/track_variance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace vergence::detail {
namespace {

using Shared = SharedMatrix;
using Index = Eigen::Index;

// Minimum number of frames of a cluster in time.
constexpr std::size_t kBlockFrames = 8;
// Maximum factor of the variance for a small number of clusters.
constexpr double kMaxFewClusters = 4;

/// Gradients of a track's observations from the camera model, with their robust weights.
class TrackGradient {
 public:
  TrackGradient(const BundleWorkspace& w, const BundleOptions& options, const BundleState& state,
                const System& system) noexcept
      : w_(w),
        options_(options),
        state_(state),
        job_(system.job()),
        first_(static_cast<std::size_t>(w.free_poses) * kBlock),
        ld_(system.ld()) {}

  /// Returns s_j, this track's gradient of θ_S with its point and the poses eliminated.
  SharedVector operator()(const BundleProblem& problem, std::size_t index) noexcept {
    const SharedLayout& layout = job_.shared;
    SharedVector s = SharedVector::Zero(layout.size);
    const auto point = static_cast<std::uint32_t>(w_.order[index]);
    const std::size_t batch = index / kBatch, lane = index % kBatch;
    const Vec3 X = coordinates(batch, lane);
    for (std::uint32_t i = w_.first_observation[point]; i < w_.first_observation[point + 1]; ++i)
      add_observation(problem.observations[i], X, &s);
    const double* z = job_.factors + (batch * kFactorRows + 6) * kBatch + lane;
    const auto product = [&](const double* y) {
      return y[0] * z[0] + y[kBatch] * z[kBatch] + y[2 * kBatch] * z[2 * kBatch];
    };
    for (std::uint32_t b = w_.batches[batch].block_begin; b < w_.batches[batch].block_end; ++b) {
      const std::int32_t block = w_.poses[w_.blocks[b].pose].block;
      if (block < 0) continue;
      const double* y = job_.y + b * kYTop + lane;
      const Vec3 point_gradient(product(y), product(y + 3 * kBatch), product(y + 6 * kBatch));
      subtract_pose(block, pose_gradient(-point_gradient, state_.poses[w_.blocks[b].pose] * X), &s);
    }
    const double* rows =
        job_.y_shared + batch * static_cast<std::size_t>(layout.blocks) * kYSize + lane;
    for (int r = 0; r < layout.size; ++r)
      s[r] -= product(rows + static_cast<std::size_t>(r) * 3 * kBatch);
    return s;
  }

 private:
  Vec3 coordinates(std::size_t batch, std::size_t lane) const noexcept {
    const auto c = [&](std::size_t i) { return state_.points[(batch * 3 + i) * kBatch + lane]; };
    return {c(0), c(1), c(2)};
  }

  /// Gradient with respect to (τ, φ), where q is that with respect to the point in the base camera.
  static Vec6 pose_gradient(const Vec3& q, const Vec3& Xi) noexcept {
    Vec6 gradient;
    gradient << q, Xi.cross(q);
    return gradient;
  }

  void subtract_pose(std::int32_t block, const Vec6& gradient, SharedVector* s) const noexcept {
    const double* K = w_.A.data() + static_cast<std::size_t>(block) * kBlock * ld_ + first_;
    for (Index r = 0; r < kBlock; ++r, K += ld_)
      for (Index i = 0; i < s->size(); ++i) (*s)[i] -= K[i] * gradient[r];
  }

  double weight(double squared) const noexcept {
    const double c = options_.loss_threshold;
    if (options_.loss == BundleLoss::huber) return squared > c * c ? c / std::sqrt(squared) : 1.0;
    return options_.loss == BundleLoss::cauchy ? 1.0 / (1.0 + squared / (c * c)) : 1.0;
  }

  void add_observation(const BundleObservation& o, const Vec3& X, SharedVector* s) const noexcept {
    const SharedLayout& layout = job_.shared;
    const Camera& camera = state_.cameras[o.camera];
    const Transform& T = state_.T_camera_left[o.camera];
    const Vec3 Xi = state_.poses[o.pose] * X, Xc = T * Xi;
    Vec2 pixel;
    Mat23 G;
    if (camera.project(Xc, &pixel, &G) != ProjectStatus::ok) return;
    const double information =
        static_cast<double>(o.inverse_sigma) * static_cast<double>(o.inverse_sigma);
    const Vec2 miss(o.x - pixel.x(), o.y - pixel.y());
    const Vec2 weighted = weight(miss.squaredNorm() * information) * information * miss;
    const Vec3 q = (G * T.R).transpose() * weighted;
    const Vec6 gradient = pose_gradient(q, Xi);
    const std::int32_t block = w_.poses[o.pose].block;
    if (block >= 0) subtract_pose(block, gradient, s);
    const int k = o.camera;
    if (layout.extrinsic[k] >= 0) {
      const Vec6 own = extrinsic_basis(layout, job_.cameras[k], k).transpose() * gradient;
      for (int i = 0; i < (layout.exact[k] ? 5 : 6); ++i) (*s)[layout.extrinsic[k] + i] += own[i];
    }
    if (layout.intrinsic_count[k] == 0) return;
    const auto J = camera.intrinsics_jacobian(Xc);
    for (int i = 0; i < layout.intrinsic_count[k]; ++i)
      (*s)[layout.intrinsic[k] + i] += J.col(layout.intrinsic_index[k][i]).dot(weighted);
  }

  const BundleWorkspace& w_;
  const BundleOptions& options_;
  const BundleState& state_;
  const KernelJob& job_;
  std::size_t first_, ld_;
};

/// Σ_j s_j s_jᵀ with each track as a cluster.
Shared variance_by_tracks(const BundleWorkspace& w, const BundleProblem& problem,
                          TrackGradient& gradient, int size) noexcept {
  Shared meat = Shared::Zero(size, size);
  for (std::size_t i = 0; i < w.point_count; ++i) {
    const SharedVector s = gradient(problem, i);
    meat.noalias() += s.lazyProduct(s.transpose());
  }
  return meat;
}

/// Sums of gradients by cluster.
class Clusters {
 public:
  explicit Clusters(int size) noexcept : size_(size) {}
  void add(std::size_t cluster, const SharedVector& s) noexcept {
    if (any_[cluster])
      sums_[cluster] += s;
    else
      sums_[cluster] = s;
    any_[cluster] = true;
  }
  /// False for a single cluster, whose gradient is zero at the minimum, whatever its errors.
  [[nodiscard]] bool enough() const noexcept {
    return std::count(any_.begin(), any_.end(), true) > 1;
  }
  /// Σ s sᵀ, corrected for a small number n of clusters: the mean takes one degree of freedom, and
  /// each of `parameters` another.
  [[nodiscard]] Shared variance(int parameters) const noexcept {
    Shared meat = Shared::Zero(size_, size_);
    int n = 0;
    for (std::size_t c = 0; c < sums_.size(); ++c) {
      if (!any_[c]) continue;
      ++n;
      meat.noalias() += sums_[c].lazyProduct(sums_[c].transpose());
    }
    return meat * std::min(kMaxFewClusters, n / std::max(1.0, static_cast<double>(n - parameters)));
  }

 private:
  int size_;
  std::array<SharedVector, static_cast<std::size_t>(kMaxCells* kMaxCells)> sums_;
  std::array<bool, static_cast<std::size_t>(kMaxCells* kMaxCells)> any_{};
};

/// Variance with two kinds of larger clusters, in which tracks share errors: cells of the left
/// image (residual lens errors) and blocks of frames (effects of the scene). With independent
/// errors each gives the variance by tracks, so their mean is used. If all tracks are in one cell
/// or block, only the other kind is used, or the tracks.
Shared variance_by_cells(const BundleWorkspace& w, const BundleProblem& problem, int cells,
                         TrackGradient& gradient, int size) noexcept {
  Clusters by_cell(size), by_block(size);
  const Intrinsics& lens = problem.cameras[0].intrinsics();
  const auto cell_of = [&](double at, int length) {
    return std::clamp(static_cast<int>(at * cells / length), 0, cells - 1);
  };
  const std::size_t poses = problem.T_left_world.size();
  const std::size_t blocks =
      std::clamp<std::size_t>(poses / kBlockFrames, 1, static_cast<std::size_t>(kMaxCells));
  for (std::size_t i = 0; i < w.point_count; ++i) {
    const auto point = static_cast<std::uint32_t>(w.order[i]);
    const std::uint32_t begin = w.first_observation[point], end = w.first_observation[point + 1];
    // The middle observation; any image will do, because all fields are functions of the direction.
    const BundleObservation& middle = problem.observations[begin + (end - begin) / 2];
    const SharedVector s = gradient(problem, i);
    by_cell.add(static_cast<std::size_t>(cell_of(middle.y, lens.height) * cells +
                                         cell_of(middle.x, lens.width)),
                s);
    by_block.add(middle.pose * blocks / poses, s);
  }
  if (!by_cell.enough())
    return by_block.enough() ? by_block.variance(1)
                             : variance_by_tracks(w, problem, gradient, size);
  const Shared cell = by_cell.variance(size);
  return by_block.enough() ? Shared(0.5 * (cell + by_block.variance(1))) : cell;
}

}  // namespace

SharedMatrix track_variance(const BundleWorkspace& w, const BundleProblem& problem,
                            const BundleOptions& options, const BundleState& state,
                            const System& system) noexcept {
  const int size = system.job().shared.size;
  TrackGradient gradient(w, options, state, system);
  return options.cells > 0 ? variance_by_cells(w, problem, options.cells, gradient, size)
                           : variance_by_tracks(w, problem, gradient, size);
}

}  // namespace vergence::detail
