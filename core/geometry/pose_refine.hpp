#pragma once
#include <cstdint>
#include <span>

#include "core/geometry/detail/pose_problem.hpp"
#include "core/geometry/observations.hpp"

namespace vergence {

struct RefinedPose {
  /// True if there is a pose. False if the input or start is invalid, the workspace is too small,
  /// or the usable observations do not determine six degrees of freedom.
  bool usable = false;

  /// Result; the start if nothing could be refined.
  Transform T_left_world{};
  /// Σ w JᵀJ/(σ scale)² at the end, undamped; δ = (φ rad, τ m), X_left ← Exp(φ) X_left + τ.
  Mat6 information = Mat6::Zero();
  /// Robust residual scale in input sigmas, ≥ 1.
  double scale = 1;
  /// Root mean square of the inliers' residuals, per coordinate.
  double rms_px = 0;

  /// Number of points with every usable observation below the χ² threshold.
  int inliers = 0;
};

/// Refines the pose of a rig over all cameras' observations with fixed points: Levenberg–Marquardt
/// on Huber-weighted pixels.
///
///     min Σ_o ρ(|x_o − π_k(T_k T_left_world p)| / (σ_o s)),
///     s = max(1, median |e| / 1.1774)
///
/// (1.1774 σ is the median length of a Gaussian vector of two coordinates.) s is computed at the
/// start and again after the first steps, when a rough start no longer inflates it.
///
/// If there are gross outliers then, beyond six sigmas, and `drop_gross` is set, a second round
/// continues without them: Huber's loss bounds an outlier's influence but never removes it. A wrong
/// point 5 m away weighs as much as hundreds of right ones at 50 m.
///
/// Ownership  Workspace in the arena. flags() stay valid until the next refine().
/// Threads    One caller per object. Memory: all at construction.
/// Errors     Reported by `usable`; results are never NaN. Same input, same result, on every
///            instruction set.
class PoseRefiner {
 public:
  /// `capacity`: maximum number of points. Throws std::length_error if the arena is full.
  PoseRefiner(std::size_t capacity, Arena& arena);

  /// `use` (may be empty, else one per point): bit k includes camera k's observation in the solve,
  /// for example MLESAC's flags. Flags, rms and counts cover all usable observations.
  [[nodiscard]] RefinedPose refine(const RigObservations& observations,
                                   const Transform& T_left_world, std::span<const std::uint8_t> use,
                                   bool drop_gross) noexcept;

  /// Per point of the last refine(), bit k is set if camera k's observation is below the χ²
  /// threshold.
  [[nodiscard]] std::span<const std::uint8_t> flags() const noexcept {
    return flags_.first(points_);
  }

 private:
  /// Residual scale of the observations that count.
  [[nodiscard]] double residual_scale(const Transform& T_left_world) noexcept;
  [[nodiscard]] int counted() const noexcept;
  /// Excludes gross outliers. Returns true if there were some and enough observations are left.
  [[nodiscard]] bool exclude_gross(const RefinedPose& pose) noexcept;
  /// Runs one round from pose->T_left_world and adds its steps. Returns false if rank deficient.
  [[nodiscard]] bool descend(RefinedPose* pose) noexcept;
  void describe(const RigObservations& observations, RefinedPose* pose) noexcept;

  detail::PoseProblem problem_;
  // Buffer for the median.
  std::span<double> sorted_;
  std::span<std::uint8_t> flags_;
  std::size_t points_ = 0;
};

}  // namespace vergence
