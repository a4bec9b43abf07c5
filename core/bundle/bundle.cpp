#include "core/bundle/bundle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "core/bundle/detail/covariance.hpp"
#include "core/bundle/detail/setup.hpp"
#include "core/bundle/detail/system.hpp"

namespace vergence {
namespace {

using detail::BundleState;
using detail::BundleWorkspace;
using detail::System;

// Minimum damping, above rounding.
constexpr double kMinDamping = 1e-12;
// Minimum damping if the scale is free, which nothing else constrains.
constexpr double kMinGaugeDamping = 1e-9;
// Maximum damping, at which steps are shorter than any tolerance.
constexpr double kLargestDamping = 1e10;
// Relative update below which rounding dominates.
constexpr double kSmallUpdate = 1e-10;
// Minimum relative pivot of the damped system; below it the system counts as singular.
constexpr double kPivotTolerance = 1e-14;
// Minimum relative pivot of the undamped system.
constexpr double kRankTolerance = 1e-11;

/// Makes every array of a workspace in the arena.
void lay_out(BundleWorkspace& w, const BundleCapacities& c, Arena& arena) {
  using namespace detail;
  const auto take = [&arena]<class T>(std::span<T>& out, std::size_t n, const char* who) {
    out = arena.make<T>(n, who);
  };
  w.capacity = c;
  const std::size_t batches = (c.points + kBatch - 1) / kBatch;
  w.block_capacity = c.blocks > 0 ? c.blocks : std::min(batches * c.poses, c.observations);
  w.slot_capacity = std::min(w.block_capacity * c.cameras, c.observations);
  const std::size_t shared_rows =
      c.shared ? kBlock * (c.cameras - 1) + kIntrinsicsSize * c.cameras : 0;
  const std::size_t shared_blocks = (shared_rows + kBlock - 1) / kBlock;
  w.reduced_capacity = (c.poses + shared_blocks) * kBlock;
  const std::size_t ld = (w.reduced_capacity + kBatch - 1) / kBatch * kBatch;
  take(w.order, c.points, "bundle: order of points");
  take(w.first_observation, c.points + 1, "bundle: first observations");
  take(w.pose_observations, c.poses, "bundle: observations a pose");
  take(w.pose_slot, c.poses, "bundle: slots of a batch");
  take(w.pose_cameras, c.poses, "bundle: cameras of a batch");
  take(w.observation_lane, c.observations, "bundle: places of observations");
  take(w.batches, batches, "bundle: batches");
  take(w.blocks, w.block_capacity, "bundle: pose blocks");
  take(w.slots, w.slot_capacity, "bundle: observations");
  take(w.poses, c.poses, "bundle: poses");
  take(w.point_free, batches * kBatch, "bundle: free points");
  take(w.y, w.block_capacity * kYTop, "bundle: Y of poses");
  take(w.y_shared, batches * shared_blocks * kYSize, "bundle: Y of shared parameters");
  take(w.factors, batches * kFactorRows * kBatch, "bundle: point factors");
  const auto take_sums = [&](BundleSums& s) {
    take(s.y_group, std::min(kGroupLimit * c.poses, w.block_capacity) * kYSize,
         "bundle: Y of a group");
    take(s.sums, c.poses * c.cameras * kPoseSums * kBatch, "bundle: sums of poses");
    take(s.intrinsic_sums, c.shared ? c.poses * kMaxCameras * kIntrinsicsSize * 6 * kBatch : 0,
         "bundle: sums of intrinsics");
    take(s.intrinsic_own,
         c.shared ? kMaxCameras * kIntrinsicsSize * (kIntrinsicsSize + 1) * kBatch : 0,
         "bundle: intrinsics");
    take(s.reduced, w.reduced_capacity * kBatch, "bundle: reduced gradient");
    take(s.A, ld * w.reduced_capacity, "bundle: reduced system");
  };
  take_sums(w);
  if (w.runner != nullptr) take_sums(w.second_half);
  take(w.rhs, ld, "bundle: right-hand side");
  take(w.delta, ld, "bundle: step");
  take(w.squared, w.slot_capacity * kBatch, "bundle: squared residuals");
  for (BundleState& s : w.states) {
    take(s.poses, c.poses, "bundle: state");
    take(s.points, batches * 3 * kBatch, "bundle: points");
  }
}

/// One solve(): the Levenberg–Marquardt loop and the covariances.
class Solve {
 public:
  Solve(BundleWorkspace& w, const BundleProblem& problem, const BundleOptions& options,
        BundleResult& result) noexcept
      : w_(w), problem_(problem), options_(options), result_(result), system_(w, problem, options) {
    if (options.configuration == BundleConfiguration::parallel_monocular)
      min_damping_ = kMinGaugeDamping;
  }

  void run() noexcept {
    damping_ = options_.initial_damping;
    if (!system_.linearise(best(), damping_)) {
      // A point is behind its camera.
      result_.termination = BundleTermination::invalid_input;
      return;
    }
    cost_ = system_.cost();
    squared_px_ = system_.squared_px();
    iterate();
    if (rank_suspicious_ && result_.termination != BundleTermination::rank_deficient &&
        rank_deficient())
      result_.termination = BundleTermination::rank_deficient;
    if (options_.pose_covariance) pose_covariance();
    if (options_.covariance && options_.configuration == BundleConfiguration::stereo_calibration)
      detail::shared_covariance(w_, problem_, options_, best(), system_, &result_);
    write_back();
  }

 private:
  BundleState& best() noexcept { return w_.states[best_]; }
  BundleState& other() noexcept { return w_.states[1 - best_]; }

  void iterate() noexcept {
    result_.termination = BundleTermination::max_steps;
    while (result_.steps < options_.max_steps) {
      ++result_.steps;
      std::copy_n(w_.rhs.begin(), system_.rows(), w_.delta.begin());
      pivots_ = detail::cholesky(w_.A.data(), system_.rows(), system_.rows(), system_.ld(),
                                 kPivotTolerance);
      if (pivots_.small > 0) {
        if (!retreat()) return end(BundleTermination::rank_deficient);
        continue;
      }
      watch_rank();
      detail::solve_factored(w_.A.data(), system_.rows(), system_.ld(), w_.delta.data());
      system_.move(best(), w_.delta.data(), &other());
      const bool converged = small_step();
      const bool last = converged || result_.steps == options_.max_steps;
      const double next_damping = std::max(damping_ * 0.1, min_damping_);
      const bool valid =
          std::isfinite(system_.update_squared()) &&
          (last ? system_.evaluate(other(), false) : system_.linearise(other(), next_damping));
      if (valid && system_.cost() <= cost_) {
        best_ = 1 - best_;
        cost_ = system_.cost();
        squared_px_ = system_.squared_px();
        damping_ = next_damping;
        ++result_.accepted;
        if (converged) return end(BundleTermination::converged);
        continue;
      }
      if (converged) return end(BundleTermination::converged);
      if (!retreat()) return end(BundleTermination::diverged);
    }
  }

  /// True if the step moves the newest pose and the shared parameters by less than the tolerance.
  /// Points may still move between the minima of a robust loss, which takes many steps and changes
  /// nothing else.
  [[nodiscard]] bool small_step() const noexcept {
    if (std::sqrt(system_.update_squared()) <=
        kSmallUpdate * (std::sqrt(system_.norm_squared()) + kSmallUpdate))
      return true;
    // |Lᵀ δ|² over the last rows of the factor is δᵀ times these parameters' marginal information
    // times δ.
    const std::size_t rows = system_.rows(), ld = system_.ld();
    const auto first = static_cast<std::size_t>(std::max(0, w_.free_poses - 1)) * detail::kBlock;
    double squared = 0;
    for (std::size_t c = first; c < rows; ++c) {
      double sum = 0;
      for (std::size_t r = c; r < rows; ++r) sum += w_.A[c * ld + r] * w_.delta[r];
      squared += sum * sum;
    }
    const double variance = cost_ / static_cast<double>(problem_.observations.size());
    return rows > 0 && squared <= options_.tolerance_sigmas * options_.tolerance_sigmas * variance;
  }

  /// Increases the damping about the best state. Returns false at its maximum.
  bool retreat() noexcept {
    damping_ *= 10;
    return damping_ <= kLargestDamping && system_.linearise(best(), damping_);
  }

  void end(BundleTermination t) noexcept { result_.termination = t; }

  /// Number of unobservable directions: the scale in parallel_monocular.
  int free_directions() const noexcept {
    return options_.configuration == BundleConfiguration::parallel_monocular ? 1 : 0;
  }

  /// Smallest pivot ratio of the observable directions.
  double min_seen(const detail::PivotReport& pivots) const noexcept {
    return free_directions() == 0 ? pivots.min_ratio : pivots.second_ratio;
  }

  /// Detects directions that only the damping constrains: their pivots fall with λ. One
  /// factorisation alone cannot distinguish them.
  void watch_rank() noexcept {
    // Share of the ratio, for a tenfold smaller λ.
    constexpr double kFell = 0.3;
    const double ratio = min_seen(pivots_);
    if (watched_damping_ > 0 && damping_ < 0.5 * watched_damping_)
      rank_suspicious_ = ratio < kFell * watched_ratio_;
    rank_suspicious_ = rank_suspicious_ || ratio < kRankTolerance;
    watched_damping_ = damping_;
    watched_ratio_ = ratio;
  }

  bool rank_deficient() noexcept {
    if (system_.rows() == 0 || !system_.linearise(best(), 0.0)) return false;
    // Rounding may leave the pivot of an unobserved direction above the tolerance, of either sign,
    // but far below its value with damping.
    // Share of the last ratio with damping.
    constexpr double kLeft = 0.01;
    const auto pivots =
        detail::cholesky(w_.A.data(), system_.rows(), system_.rows(), system_.ld(), kRankTolerance);
    return pivots.small > free_directions() || min_seen(pivots) < kLeft * watched_ratio_;
  }

  /// Computes the newest free pose's block of the inverse of the whole system, including θ_S, from
  /// the rows of the factor from that pose on.
  void pose_covariance() noexcept {
    const std::size_t rows = system_.rows(), ld = system_.ld();
    if (w_.free_poses == 0 || !system_.linearise(best(), 0.0)) return;
    if (detail::cholesky(w_.A.data(), rows, rows, ld, kRankTolerance).small > 0) return;
    const std::size_t first = (static_cast<std::size_t>(w_.free_poses) - 1) * detail::kBlock;
    // That pose's columns of L⁻¹, row by row.
    std::array<Vec6, detail::kBlock*(1 + detail::kMaxSharedBlocks)> inverse;
    // In the order (τ, φ).
    Mat6 covariance = Mat6::Zero();
    for (std::size_t r = first; r < rows; ++r) {
      Vec6 row = Vec6::Zero();
      if (r - first < detail::kBlock) row[static_cast<Eigen::Index>(r - first)] = 1;
      for (std::size_t k = first; k < r; ++k) row -= w_.A[k * ld + r] * inverse[k - first];
      row /= w_.A[r * ld + r];
      inverse[r - first] = row;
      covariance += row * row.transpose();
    }
    if (!covariance.allFinite()) return;
    result_.pose_covariance << covariance.bottomRightCorner<3, 3>(),
        covariance.bottomLeftCorner<3, 3>(), covariance.topRightCorner<3, 3>(),
        covariance.topLeftCorner<3, 3>();
    for (std::size_t i = 0; i < problem_.T_left_world.size(); ++i)
      if (w_.poses[i].block == w_.free_poses - 1) result_.pose = static_cast<std::uint16_t>(i);
    result_.has_pose_covariance = true;
  }

  void write_back() noexcept {
    const BundleState& s = best();
    result_.final_cost = cost_;
    result_.rms_px =
        problem_.observations.empty()
            ? 0
            : std::sqrt(squared_px_ / static_cast<double>(problem_.observations.size()));
    if (!problem_.squared_residuals.empty() && system_.evaluate(s, true))
      for (std::size_t i = 0; i < problem_.observations.size(); ++i)
        problem_.squared_residuals[i] = w_.squared[w_.observation_lane[i]];
    for (std::size_t i = 0; i < problem_.T_left_world.size(); ++i)
      if (w_.poses[i].block >= 0) problem_.T_left_world[i] = s.poses[i];
    for (std::size_t i = 0; i < w_.point_count; ++i) {
      const std::size_t batch = i / detail::kBatch, lane = i % detail::kBatch;
      for (std::size_t c = 0; c < 3; ++c)
        problem_.points[static_cast<std::uint32_t>(w_.order[i])][static_cast<Eigen::Index>(c)] =
            s.points[(batch * 3 + c) * detail::kBatch + lane];
    }
    if (options_.configuration != BundleConfiguration::stereo_calibration) return;
    for (std::size_t k = 0; k < problem_.cameras.size(); ++k) {
      if (k > 0) problem_.T_camera_left[k] = s.T_camera_left[k];
      if (options_.intrinsics[k].free != 0) problem_.cameras[k] = s.cameras[k];
    }
  }

  BundleWorkspace& w_;
  const BundleProblem& problem_;
  const BundleOptions& options_;
  BundleResult& result_;
  System system_;
  detail::PivotReport pivots_;
  int best_ = 0;
  bool rank_suspicious_ = false;
  double watched_damping_ = 0, watched_ratio_ = 1;
  double damping_ = 0, min_damping_ = kMinDamping, cost_ = 0, squared_px_ = 0;
};

}  // namespace

BundleAdjuster::BundleAdjuster(const BundleCapacities& c, Arena& arena, PairRunner* runner)
    : workspace_(nullptr) {
  // Limits of the index types.
  constexpr std::size_t kMaxPoses = 65535, kMaxObservations = 1U << 28U;
  if (c.cameras == 0 || c.cameras > kMaxCameras || c.poses == 0 || c.poses > kMaxPoses ||
      c.points > kMaxObservations || c.observations > kMaxObservations)
    throw std::invalid_argument(
        "bundle adjustment: capacities out of range (cameras 1 … 4, poses 1 … 65535)");
  workspace_ = arena.make<BundleWorkspace>(1, "bundle: workspace").data();
  workspace_->runner = runner;
  lay_out(*workspace_, c, arena);
}

BundleResult BundleAdjuster::solve(const BundleProblem& problem,
                                   const BundleOptions& options) noexcept {
  BundleResult result;
  if (detail::set_up(*workspace_, problem, options, &result))
    Solve(*workspace_, problem, options, result).run();
  return result;
}

}  // namespace vergence
