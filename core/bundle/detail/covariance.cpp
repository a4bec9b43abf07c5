#include "core/bundle/detail/covariance.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "core/bundle/detail/setup.hpp"
#include "core/bundle/detail/track_variance.hpp"

namespace vergence::detail {
namespace {

using Shared = SharedMatrix;
using Index = Eigen::Index;

constexpr double kPivotTolerance = 1e-12;

/// Rows of θ_S that are estimated, and rows that are fixed but uncertain.
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

/// Replaces L_SI by K = L_SI L_II⁻¹, a pose gradient's contribution to that of θ_S after
/// eliminating the poses.
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

/// Prior in addition to the tracks: its information, and its contribution to the gradient's
/// variance as a separate cluster.
struct PriorInformation {
  Shared information, variance;
};

PriorInformation prior_information(const SharedLayout& s, const BundleProblem& problem,
                                   const BundleOptions& options, const BundleState& state,
                                   const System& system) noexcept {
  PriorInformation known{Shared::Zero(s.size, s.size), Shared::Zero(s.size, s.size)};
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

Mat6 published(const Shared& estimated, const SharedLayout& s, const KernelCamera& camera,
               const Transform& T, int k) noexcept {
  const int size = s.exact[k] ? 5 : 6;
  Mat6 rows = Mat6::Zero();
  rows.topLeftCorner(size, size) = estimated.block(s.extrinsic[k], s.extrinsic[k], size, size);
  // (φ, τ) of the left perturbation R ← Exp(φ) R, t ← t + τ.
  Mat6 turn = Mat6::Zero();
  turn.topRightCorner<3, 3>() = T.R;
  turn.bottomLeftCorner<3, 3>() = T.R;
  const Mat6 to = turn * extrinsic_basis(s, camera, k);
  return to * rows * to.transpose();
}

/// Writes the joint covariance of estimated and fixed parameters in RigCovariance's order.
void publish_all(const Shared& joint, const Combination* rows, RigCovariance* out) noexcept {
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

/// Σ w|ε|²/σ² over the degrees of freedom.
double residual_variance(const BundleWorkspace& w, const BundleProblem& problem, const Partition& p,
                         double weighted) noexcept {
  const double freedom = 2.0 * static_cast<double>(problem.observations.size()) -
                         3.0 * static_cast<double>(w.point_count) -
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
  const Shared meat = track_variance(w, problem, options, state, system);
  const PriorInformation known = prior_information(layout, problem, options, state, system);
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
  // Extrinsics are the first rows of both θ_S and the estimated ones; the partition gives the rows
  // of intrinsics.
  for (std::size_t k = 1; k < problem.cameras.size(); ++k) {
    const int number = static_cast<int>(k);
    const KernelCamera& camera = system.job().cameras[k];
    const Transform& T = state.T_camera_left[k];
    result->covariance_white[k] = published(white, layout, camera, T, number);
    result->covariance_noise[k] = published(noise, layout, camera, T, number);
    result->covariance_total[k] = published(wide, layout, camera, T, number);
  }
  Combination rows[kMaxShared];
  for (std::size_t k = 1; k < problem.cameras.size(); ++k) {
    const int number = static_cast<int>(k);
    const Mat6 basis = extrinsic_basis(layout, system.job().cameras[k], number);
    for (int i = 0; i < (layout.exact[k] ? 5 : 6); ++i)
      rows[layout.extrinsic[k] + i] =
          extrinsic_combination(basis, state.T_camera_left[k].R, number, i);
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
