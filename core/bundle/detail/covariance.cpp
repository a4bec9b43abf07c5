#include "core/bundle/detail/covariance.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

#include "core/bundle/detail/setup.hpp"

namespace vergence::detail {
namespace {

using Shared = SharedMatrix;
using Index = Eigen::Index;

constexpr double kPivotTolerance = 1e-12;
constexpr std::size_t kBlockFrames = 8;  // at least, of a cluster in time
constexpr double kMostFewClusters = 4;   // times the variance, for there being few of them

/// Rows of θ_S that are estimated, and those that are held but uncertain.
struct Partition {
  int estimated[kMaxShared], held[kMaxShared];
  double held_variance[kMaxShared];
  int estimated_count = 0, held_count = 0;
};

Partition partition(const SharedLayout& s, const BundleProblem& problem,
                    const BundleOptions& options) noexcept {
  Partition p;
  for (std::size_t k = 0; k < problem.cameras.size(); ++k)
    if (s.extrinsic[k] >= 0)
      for (int i = 0; i < (s.exact[k] ? 5 : 6); ++i)
        p.estimated[p.estimated_count++] = s.extrinsic[k] + i;
  for (std::size_t k = 0; k < problem.cameras.size(); ++k)
    for (int i = 0; i < s.intrinsic_count[k]; ++i) {
      const int parameter = s.intrinsic_index[k][i], row = s.intrinsic[k] + i;
      if (((options.intrinsics[k].free >> static_cast<unsigned>(parameter)) & 1U) != 0) {
        p.estimated[p.estimated_count++] = row;
      } else {
        const double sigma =
            held_sigma(options.intrinsics[k], problem.cameras[k].intrinsics(), parameter);
        p.held_variance[p.held_count] = sigma * sigma;
        p.held[p.held_count++] = row;
      }
    }
  return p;
}

/// K = L_SI L_II⁻¹ in the place of L_SI: what a pose's gradient adds to that of θ_S once the poses
/// are eliminated.
void poses_to_shared(double* A, std::size_t ld, std::size_t first, std::size_t size) noexcept {
  for (std::size_t c = first; c-- > 0;) {
    double* column = A + c * ld;
    for (std::size_t q = c + 1; q < first; ++q) {
      const double factor = column[q];
      if (factor == 0) continue;
      const double* other = A + q * ld + first;
      for (std::size_t s = 0; s < size; ++s) column[first + s] -= factor * other[s];
    }
    for (std::size_t s = 0; s < size; ++s) column[first + s] /= column[c];
  }
}

/// The gradients of one lane's observations, straight from the camera model, and the robust weight
/// of each.
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

  /// s_j: the gradient of θ_S that this track causes, its point and the poses eliminated.
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
      for (std::size_t r = 0; r < kBlock; ++r)
        subtract_pose(static_cast<std::size_t>(block) * kBlock + r,
                      -product(job_.y + b * kYSize + r * 3 * kBatch + lane), &s);
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

  void subtract_pose(std::size_t row, double gradient, SharedVector* s) const noexcept {
    const double* K = w_.A.data() + row * ld_ + first_;
    for (Index i = 0; i < s->size(); ++i) (*s)[i] -= K[i] * gradient;
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
    Vec6 gradient;
    gradient << q, Xi.cross(q);
    const std::int32_t block = w_.poses[o.pose].block;
    if (block >= 0)
      for (std::size_t r = 0; r < kBlock; ++r)
        subtract_pose(static_cast<std::size_t>(block) * kBlock + r, gradient[static_cast<Index>(r)],
                      s);
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

/// What is known beside the tracks: its information in H, and the variance that it brings into the
/// gradient (clusters of their own).
struct KnownBeside {
  Shared information, variance;
};

KnownBeside known_beside(const SharedLayout& s, const BundleProblem& problem,
                         const BundleOptions& options, const BundleState& state,
                         const System& system) noexcept {
  KnownBeside known{Shared::Zero(s.size, s.size), Shared::Zero(s.size, s.size)};
  for (std::size_t k = 0; k < problem.cameras.size(); ++k) {
    if (s.extrinsic[k] >= 0 && options.length[k].kind == BundleLength::measured) {
      const Transform& T = state.T_camera_left[k];
      const Vec3 j = T.R.transpose() * T.t.normalized() / options.length[k].sigma;
      known.information.block<3, 3>(s.extrinsic[k], s.extrinsic[k]) += j * j.transpose();
    }
    for (int i = 0; i < s.intrinsic_count[k]; ++i) {
      const std::size_t parameter = s.intrinsic_index[k][i];
      const double sigma = options.intrinsics[k].prior_sigma[parameter];
      if (((options.intrinsics[k].free >> parameter) & 1U) != 0 && sigma > 0)
        known.information(s.intrinsic[k] + i, s.intrinsic[k] + i) += 1.0 / (sigma * sigma);
    }
  }
  known.variance = known.information;
  if (system.shared_prior().used()) {
    known.information += system.shared_prior().information();
    known.variance += system.shared_prior().weight() * system.shared_prior().information();
  }
  return known;
}

/// Σ_j s_j s_jᵀ, a cluster a track.
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
  /// A single cluster's gradient is zero at the minimum, whatever its errors: it says nothing.
  [[nodiscard]] bool enough() const noexcept {
    return std::count(any_.begin(), any_.end(), true) > 1;
  }
  /// Σ s sᵀ, made up for there being few: a mean over n clusters has taken up one of them, and
  /// `parameters` each one more.
  [[nodiscard]] Shared variance(int parameters) const noexcept {
    Shared meat = Shared::Zero(size_, size_);
    int n = 0;
    for (std::size_t c = 0; c < sums_.size(); ++c) {
      if (!any_[c]) continue;
      ++n;
      meat.noalias() += sums_[c].lazyProduct(sums_[c].transpose());
    }
    return meat *
           std::min(kMostFewClusters, n / std::max(1.0, static_cast<double>(n - parameters)));
  }

 private:
  int size_;
  std::array<SharedVector, static_cast<std::size_t>(kMostCells* kMostCells)> sums_;
  std::array<bool, static_cast<std::size_t>(kMostCells* kMostCells)> any_{};
};

/// The same with larger clusters, of two kinds, since tracks share errors in both ways: a cell of
/// the left image (what a lens model leaves is a field over the image, common to all tracks there),
/// and a block of frames (what a scene does to it). Under independent errors each gives the
/// variance by tracks; the mean of both is taken. Where all tracks are in one cell, or in the
/// middle of their lives in one block, the other kind is left, or the tracks.
Shared variance_by_cells(const BundleWorkspace& w, const BundleProblem& problem, int cells,
                         TrackGradient& gradient, int size) noexcept {
  Clusters by_cell(size), by_block(size);
  const Intrinsics& lens = problem.cameras[0].intrinsics();
  const auto cell_of = [&](double at, int length) {
    return std::clamp(static_cast<int>(at * cells / length), 0, cells - 1);
  };
  const std::size_t poses = problem.T_left_world.size();
  const std::size_t blocks =
      std::clamp<std::size_t>(poses / kBlockFrames, 1, static_cast<std::size_t>(kMostCells));
  for (std::size_t i = 0; i < w.point_count; ++i) {
    const auto point = static_cast<std::uint32_t>(w.order[i]);
    const std::uint32_t begin = w.first_observation[point], end = w.first_observation[point + 1];
    // In the middle of its life; any image does, for the fields of all are fields over the
    // direction.
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

/// From the rows of camera k to (φ, τ) of the left perturbation R ← Exp(φ) R, t ← t + τ; its first
/// columns are the rows that there are.
Mat6 to_published(const SharedLayout& s, const KernelCamera& camera, const Transform& T,
                  int k) noexcept {
  Mat6 turn = Mat6::Zero();
  turn.topRightCorner<3, 3>() = T.R;
  turn.bottomLeftCorner<3, 3>() = T.R;
  return turn * extrinsic_basis(s, camera, k);
}

Mat6 published(const Shared& estimated, const SharedLayout& s, const KernelCamera& camera,
               const Transform& T, int k) noexcept {
  const int size = s.exact[k] ? 5 : 6;
  Mat6 rows = Mat6::Zero();
  rows.topLeftCorner(size, size) = estimated.block(s.extrinsic[k], s.extrinsic[k], size, size);
  const Mat6 to = to_published(s, camera, T, k);
  return to * rows * to.transpose();
}

/// A row of θ_S as rows of RigCovariance with their factors.
struct PublishedRow {
  int first = 0, count = 0;
  double factor[6]{};
};

/// The joint covariance of what is estimated and what is held, in RigCovariance's order.
void publish_all(const Shared& joint, const PublishedRow* rows, RigCovariance* out) noexcept {
  const auto n = static_cast<int>(joint.rows());
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < n; ++b)
      for (int i = 0; i < rows[a].count; ++i)
        for (int j = 0; j < rows[b].count; ++j) {
          const int r = rows[a].first + i, c = rows[b].first + j;
          if (c <= r)
            out->set(r, c, (*out)(r, c) + rows[a].factor[i] * rows[b].factor[j] * joint(a, b));
        }
}

/// Σ w|ε|²/σ² over what is left after the parameters.
double residual_variance(const BundleWorkspace& w, const BundleProblem& problem, const Partition& p,
                         double weighted) noexcept {
  const double freedom = 2.0 * static_cast<double>(problem.observations.size()) -
                         3.0 * static_cast<double>(w.free_points) -
                         static_cast<double>(kBlock * w.free_poses) - p.estimated_count;
  return freedom > 0 ? weighted / freedom : 1.0;
}

}  // namespace

void shared_covariance(BundleWorkspace& w, const BundleProblem& problem,
                       const BundleOptions& options, const BundleState& state, System& system,
                       BundleResult* result) noexcept {
  const SharedLayout layout = shared_layout(problem, options, true);
  system.use(layout);
  if (!system.linearise(state, 0.0)) return;
  const std::size_t first = static_cast<std::size_t>(w.free_poses) * kBlock, ld = system.ld();
  const auto size = static_cast<std::size_t>(layout.size);
  double* A = w.A.data();
  if (cholesky(A, system.rows(), first, ld, kPivotTolerance).small > 0) return;

  Shared H(layout.size, layout.size);
  for (std::size_t r = 0; r < size; ++r)
    for (std::size_t c = 0; c <= r; ++c) {
      double v = A[(first + c) * ld + first + r];
      for (std::size_t k = 0; k < first; ++k) v -= A[k * ld + first + r] * A[k * ld + first + c];
      H(static_cast<Index>(r), static_cast<Index>(c)) =
          H(static_cast<Index>(c), static_cast<Index>(r)) = v;
    }
  const Partition p = partition(layout, problem, options);
  Shared inner(p.estimated_count, p.estimated_count), cross(p.estimated_count, p.held_count);
  for (int r = 0; r < p.estimated_count; ++r) {
    for (int c = 0; c < p.estimated_count; ++c) inner(r, c) = H(p.estimated[r], p.estimated[c]);
    for (int c = 0; c < p.held_count; ++c) cross(r, c) = H(p.estimated[r], p.held[c]);
  }
  const Eigen::LLT<Shared> factor(inner);
  if (factor.info() != Eigen::Success) return;
  const Shared inverse = factor.solve(Shared::Identity(p.estimated_count, p.estimated_count));
  if (!inverse.allFinite()) return;

  poses_to_shared(A, ld, first, size);
  TrackGradient gradient(w, options, state, system);
  const Shared meat = options.cells > 0
                          ? variance_by_cells(w, problem, options.cells, gradient, layout.size)
                          : variance_by_tracks(w, problem, gradient, layout.size);
  const KnownBeside known = known_beside(layout, problem, options, state, system);
  Shared own_meat(p.estimated_count, p.estimated_count);
  double clustered = 0, believed = 0;
  for (int r = 0; r < p.estimated_count; ++r)
    for (int c = 0; c < p.estimated_count; ++c) {
      const int row = p.estimated[r], column = p.estimated[c];
      const double of_tracks = options.shared_errors * meat(row, column);
      own_meat(r, c) = of_tracks + known.variance(row, column);
      clustered += inverse(r, c) * of_tracks;
      believed += inverse(r, c) * (inner(r, c) - known.information(row, column));
    }
  result->inflation = believed > 0 ? clustered / believed : options.shared_errors;

  result->sigma0_squared = residual_variance(w, problem, p, system.weighted());
  const Shared white = result->sigma0_squared * inverse;
  const Shared noise = inverse.lazyProduct(Shared(own_meat.lazyProduct(inverse)));
  Shared wide = noise;
  const int all = p.estimated_count + p.held_count;
  Shared joint = Shared::Zero(all, all);
  if (p.held_count > 0) {
    const Shared D = inverse.lazyProduct(cross);
    Shared scaled = D;
    for (int c = 0; c < p.held_count; ++c) scaled.col(c) *= p.held_variance[c];
    wide += scaled.lazyProduct(D.transpose());
    joint.topRightCorner(p.estimated_count, p.held_count) = -scaled;
    joint.bottomLeftCorner(p.held_count, p.estimated_count) = -scaled.transpose();
    for (int c = 0; c < p.held_count; ++c)
      joint(p.estimated_count + c, p.estimated_count + c) = p.held_variance[c];
  }
  joint.topLeftCorner(p.estimated_count, p.estimated_count) = wide;
  // Extrinsics are the first rows of θ_S and of the estimated ones alike; intrinsics are found by
  // their place in the partition.
  for (std::size_t k = 1; k < problem.cameras.size(); ++k) {
    const int number = static_cast<int>(k);
    const KernelCamera& camera = system.job().cameras[k];
    const Transform& T = state.T_camera_left[k];
    result->covariance_white[k] = published(white, layout, camera, T, number);
    result->covariance_noise[k] = published(noise, layout, camera, T, number);
    result->covariance_wide[k] = published(wide, layout, camera, T, number);
  }
  PublishedRow rows[kMaxShared];
  for (std::size_t k = 1; k < problem.cameras.size(); ++k) {
    const int number = static_cast<int>(k);
    const Mat6 to = to_published(layout, system.job().cameras[k], state.T_camera_left[k], number);
    for (int i = 0; i < (layout.exact[k] ? 5 : 6); ++i) {
      PublishedRow& row = rows[layout.extrinsic[k] + i];
      row.first = extrinsic_row(number);
      row.count = 6;
      for (int j = 0; j < 6; ++j) row.factor[j] = to(j, i);
    }
  }
  for (int i = 0; i < all; ++i) {
    const bool estimated = i < p.estimated_count;
    const int row = estimated ? p.estimated[i] : p.held[i - p.estimated_count];
    for (std::size_t k = 0; k < problem.cameras.size(); ++k) {
      const int place = row - layout.intrinsic[k];
      if (layout.intrinsic_count[k] == 0 || place < 0 || place >= layout.intrinsic_count[k])
        continue;
      const int parameter = layout.intrinsic_index[k][place];
      rows[i].first = intrinsic_row(static_cast<int>(k)) + parameter;
      rows[i].count = 1;
      rows[i].factor[0] = 1;
      if (estimated)
        result->intrinsics_sigma[k][static_cast<std::size_t>(parameter)] =
            std::sqrt(std::max(0.0, noise(i, i)));
    }
  }
  publish_all(joint, rows, &result->covariance);
  result->has_covariance = true;
}

}  // namespace vergence::detail
