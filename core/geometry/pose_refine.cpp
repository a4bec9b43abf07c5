#include "core/geometry/pose_refine.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/math/linear_solve.hpp"
#include "core/math/robust.hpp"

namespace vergence {
namespace {

constexpr const char* kWho = "pose refinement";
// √(2 ln 2).
constexpr double kRayleighMedian = 1.1774100225154747;
constexpr int kMinObservations = 3;
// Maximum number of solver steps per round; four are usual.
constexpr int kMaxSteps = 10;
// Update in rad and m below which the solver has converged.
constexpr double kSmallUpdate = 1e-7;
// Squared residual in scaled sigmas above which an observation is left out of the second round.
constexpr double kGrossChi2 = 36;
// Number of steps after which the pose is within about two sigmas.
constexpr int kRescaleAfter = 2;
// Damping relative to the diagonal after a plain step has failed.
constexpr double kFirstDamping = 1e-4;
// Damping grows tenfold per failure; after this many, rounding dominates.
constexpr int kMaxFailures = 6;
// Maximum condition of the scaled information; above it double precision does not resolve the worst
// direction.
constexpr double kMaxCondition = 1e12;

[[nodiscard]] bool small(const Vec6& delta) noexcept {
  return delta.head<3>().norm() < kSmallUpdate && delta.tail<3>().norm() < kSmallUpdate;
}

}  // namespace

PoseRefiner::PoseRefiner(std::size_t capacity, Arena& arena)
    : problem_(capacity, arena, kWho),
      sorted_(arena.make<double>(static_cast<std::size_t>(kMaxCameras) * capacity, kWho)),
      flags_(arena.make<std::uint8_t>(capacity, kWho)) {}

double PoseRefiner::residual_scale(const Transform& T) noexcept {
  problem_.evaluate(T);
  std::size_t n = 0;
  for (int k = 0; k < problem_.cameras(); ++k) {
    const std::span<const double> errors = problem_.errors(k);
    for (std::size_t i = 0; i < errors.size(); ++i)
      if (problem_.counts(k, i)) sorted_[n++] = errors[i];
  }
  if (n == 0) return 1;
  const double scale = std::sqrt(median(sorted_.first(n))) / kRayleighMedian;
  return std::isfinite(scale) ? std::max(1.0, scale) : 1;
}

int PoseRefiner::counted() const noexcept {
  int n = 0;
  for (int k = 0; k < problem_.cameras(); ++k)
    for (std::size_t i = 0; i < problem_.count(k); ++i) n += problem_.counts(k, i) ? 1 : 0;
  return n;
}

bool PoseRefiner::exclude_gross(const RefinedPose& pose) noexcept {
  problem_.evaluate(pose.T_left_world);
  const double limit = kGrossChi2 * pose.scale * pose.scale;
  bool dropped = false;
  for (int k = 0; k < problem_.cameras(); ++k) {
    const std::span<const double> errors = problem_.errors(k);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (!problem_.counts(k, i) || !(errors[i] > limit)) continue;
      problem_.use(k, i, false);
      dropped = true;
    }
  }
  return dropped && counted() >= kMinObservations;
}

bool PoseRefiner::descend(RefinedPose* pose) noexcept {
  pose->scale = residual_scale(pose->T_left_world);
  detail::PoseProblem::Sums now = problem_.sums(pose->T_left_world, pose->scale, kHuber);
  double damping = 0;
  int failures = 0;
  bool rescaled = false;
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    if (!rescaled && steps >= kRescaleAfter && failures == 0) {
      rescaled = true;
      pose->scale = residual_scale(pose->T_left_world);
      now = problem_.sums(pose->T_left_world, pose->scale, kHuber);
    }
    Mat6 H = now.H;
    H.diagonal() *= 1.0 + damping;
    Vec6 delta;
    if (!detail::solve_normal(H, now.g, &delta)) {
      if (++failures > kMaxFailures) return false;
      damping = damping > 0 ? 10.0 * damping : kFirstDamping;
      continue;
    }
    const Transform next = detail::moved(pose->T_left_world, delta);
    const detail::PoseProblem::Sums then = problem_.sums(next, pose->scale, kHuber);
    // Tolerate rounding of the sum, because steps at the optimum change nothing.
    if (!(then.cost <= now.cost * (1.0 + 1e-12)) || !next.finite()) {
      if (small(delta) || ++failures > kMaxFailures) break;
      damping = damping > 0 ? 10.0 * damping : kFirstDamping;
      continue;
    }
    pose->T_left_world = next;
    now = then;
    damping *= 0.1;
    if (damping < 1e-9) damping = 0;
    failures = 0;
    if (small(delta)) break;
  }
  // Information and flags use the final scale.
  if (!rescaled) {
    pose->scale = residual_scale(pose->T_left_world);
    now = problem_.sums(pose->T_left_world, pose->scale, kHuber);
  }
  pose->information = now.H;
  return true;
}

void PoseRefiner::describe(const RigObservations& o, RefinedPose* pose) noexcept {
  problem_.evaluate(pose->T_left_world);
  std::fill_n(flags_.begin(), points_, std::uint8_t{0});
  const double limit = kChi2OfPixel * pose->scale * pose->scale;
  double sum_px2 = 0;
  int agreeing = 0;
  for (int k = 0; k < problem_.cameras(); ++k) {
    const std::span<const double> errors = problem_.errors(k);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (!(errors[i] < limit)) continue;
      const std::size_t p = problem_.point(k, i);
      flags_[p] = static_cast<std::uint8_t>(flags_[p] | (1U << k));
      sum_px2 += errors[i] * o.sigma[p] * o.sigma[p];
      ++agreeing;
    }
  }
  for (std::size_t i = 0; i < points_; ++i)
    pose->inliers += flags_[i] != 0 && flags_[i] == o.seen[i] ? 1 : 0;
  if (agreeing > 0) pose->rms_px = std::sqrt(sum_px2 / (2.0 * agreeing));
}

RefinedPose PoseRefiner::refine(const RigObservations& o, const Transform& start,
                                std::span<const std::uint8_t> use, bool drop_gross) noexcept {
  RefinedPose out;
  out.T_left_world = start;
  points_ = 0;
  if (!o.consistent() || !start.finite() || (!use.empty() && use.size() != o.size()) ||
      o.size() > flags_.size())
    return out;
  points_ = o.size();
  std::fill_n(flags_.begin(), points_, std::uint8_t{0});
  problem_.gather(o);
  for (int k = 0; k < problem_.cameras(); ++k)
    for (std::size_t i = 0; i < problem_.count(k); ++i) {
      const bool counts = use.empty() || ((use[problem_.point(k, i)] >> k) & 1U) != 0;
      if (!counts) problem_.use(k, i, false);
    }
  if (counted() < kMinObservations) return out;

  if (!descend(&out)) return out;
  if (drop_gross && exclude_gross(out)) {
    // If the remaining observations do not determine the pose, keep that of all.
    const RefinedPose of_all = out;
    if (!descend(&out)) out = of_all;
  }
  describe(o, &out);

  Vec6 d;
  for (int i = 0; i < 6; ++i) {
    if (!(out.information(i, i) > 0.0) || !std::isfinite(out.information(i, i))) return out;
    d[i] = 1.0 / std::sqrt(out.information(i, i));
  }
  const Mat6 unit = d.asDiagonal() * out.information * d.asDiagonal();
  const Vec6 scaled = semidefinite_eigenvalues(unit);
  if (!(scaled[5] > scaled[0] / kMaxCondition)) return out;
  out.usable = true;
  return out;
}

}  // namespace vergence
