#pragma once
#include <cstdint>
#include <span>

#include "core/geometry/detail/pose_problem.hpp"
#include "core/geometry/observations.hpp"
#include "core/math/robust.hpp"

namespace vergence {

struct PoseRefineOptions {
  int max_steps = 10;  // solver steps a round, 1 … 10; four are usual
  double huber = 2.0;  // threshold in scaled sigmas, > 0
  double min_scale =
      1.0;  // floor of the residual scale in given sigmas: a good frame does not make them smaller
  double inlier_chi2 = kChi2OfPixel;
  double gross_chi2 = 36.0;    // squared scaled sigmas: beyond it an observation does not count in
                               // the second round; > 0
  double small_update = 1e-7;  // rad and m: converged below it
};

struct RefinedPose {
  /// There is a pose. Not so where the input, the start or the options cannot be, there are more
  /// points than the workspace holds, fewer than three usable observations, or these do not hold
  /// six degrees of freedom.
  bool usable = false;
  bool converged = false;           // else it was still moving: the pose is the best so far
  Transform T_left_world{};         // the start where nothing could be refined
  Mat6 information = Mat6::Zero();  // Σ w JᵀJ/(σ scale)² at the end, undamped; δ = (φ rad, τ m),
                                    // X_left ← Exp(φ) X_left + τ
  double rotation_sigma = 0;     // rad, in the direction known worst, the translation unknown
  double translation_sigma = 0;  // m, likewise: camera position; large → weak_geometry
  double scale = 1;              // robust residual scale in given sigmas, ≥ min_scale
  double rms_px = 0;             // of the inliers' residuals, per coordinate
  int inliers = 0;               // points with every usable observation under the χ² threshold
  int inlier_observations = 0;
  int observations = 0;
  int steps = 0;
};

/// Pose of a rig over all cameras' observations with points held: Levenberg–Marquardt on
/// Huber-weighted pixels.
///
///     min Σ_o ρ(|x_o − π_k(T_k T_left_world p)| / (σ_o s)),   s = max(min_scale, median |e|
///     / 1.1774)
///
/// (1.1774 σ is the median length of a Gaussian vector of two coordinates: the MAD of the
/// residuals). s is taken at the start and again after the first steps, when a rough start no
/// longer inflates it.
///
/// Where observations are gross then (gross_chi2), a second round goes on without them: Huber's
/// loss bounds an outlier's pull but never ends it, and a wrong point 5 m away weighs as much as
/// hundreds of right ones at 50 m: three of them move a pose by a decimetre.
///
/// Ownership  Workspace in the arena. flags() stay valid until the next refine().
/// Threads    One caller per object. Memory: all at construction.
/// Errors     Not usable; nothing that comes out is NaN. Same input, same result, on every
///            instruction set.
class PoseRefiner {
 public:
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  /// At most `capacity` points. Throws std::length_error when the arena is full.
  PoseRefiner(std::size_t capacity, Arena& arena);

  /// `use` (may be empty, else one per point): bit k set lets camera k's observation into the
  /// solve, MLESAC's flags for instance. Flags, rms and counts are over all usable observations
  /// regardless.
  [[nodiscard]] RefinedPose refine(const RigObservations& observations,
                                   const Transform& T_left_world, std::span<const std::uint8_t> use,
                                   const PoseRefineOptions& options) noexcept;

  /// For each point of the last refine(): bit k set if camera k's observation is under the χ²
  /// threshold.
  [[nodiscard]] std::span<const std::uint8_t> flags() const noexcept {
    return flags_.first(points_);
  }

 private:
  /// Over the observations that count.
  [[nodiscard]] double residual_scale(const Transform& T_left_world, double floor) noexcept;
  [[nodiscard]] int counted() const noexcept;
  /// Gross observations no longer count. True: there were some, and enough are left.
  [[nodiscard]] bool drop_gross(const RefinedPose& pose, const PoseRefineOptions& options) noexcept;
  /// One round from pose->T_left_world; adds its steps. False: rank deficient.
  [[nodiscard]] bool descend(const PoseRefineOptions& options, RefinedPose* pose) noexcept;
  void describe(const RigObservations& observations, const PoseRefineOptions& options,
                RefinedPose* pose) noexcept;

  detail::PoseProblem problem_;
  std::span<double> sorted_;  // for the median
  std::span<std::uint8_t> flags_;
  std::size_t points_ = 0;
};

}  // namespace vergence
