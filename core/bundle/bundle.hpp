#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/camera/camera.hpp"
#include "core/math/types.hpp"
#include "core/memory/arena.hpp"

namespace vergence {

/// Selects the free blocks of θ = [θ_S | θ_I | θ_P]: shared parameters, poses, points.
enum class BundleConfiguration : std::uint8_t {
  /// θ_S: T_camera_left of every additional camera, and selected intrinsics; θ_I: one pose per rig
  /// frame.
  stereo_calibration,
  /// θ_S is empty: T_camera_left and intrinsics are constant; θ_I: one pose per rig frame.
  stereo_odometry,
  /// θ_S is empty and T_camera_left is not read; θ_I: one pose per image.
  parallel_monocular,
};

/// One feature in one image. `x`, `y` are pixels of camera `camera` including its distortion.
///
/// stereo_*: `pose` is the rig frame, `camera` the camera of the rig: X_camera =
/// T_camera_left[camera] * T_left_world[pose] * X.
/// parallel_monocular: `pose` is the image, and `camera` only selects the intrinsics: X_camera =
/// T_left_world[pose] * X.
struct BundleObservation {
  std::uint32_t point = 0;
  std::uint16_t pose = 0;
  std::uint8_t camera = 0;
  /// Inverse standard deviation of one coordinate in 1/px, > 0.
  float inverse_sigma = 1.0F;
  /// Double precision, because float resolves only 6e-5 px at 1000 px.
  double x = 0, y = 0;
};

/// A problem in the caller's arrays; solve() writes those marked in/out.
///
/// Order  Observations are sorted by (point, pose, camera), strictly: a feature appears once.
///        Points without observations are not changed.
struct BundleProblem {
  /// 1 … kMaxCameras cameras; in/out if intrinsics are free.
  std::span<Camera> cameras;
  /// One transform per camera, the first the identity; in/out in stereo_calibration; may be empty
  /// in parallel_monocular.
  std::span<Transform> T_camera_left;
  /// Poses, in/out.
  std::span<Transform> T_left_world;
  /// One flag per pose, 1 if it is constant; if empty, only pose 0 is.
  std::span<const std::uint8_t> pose_constant;
  /// Points in the world in metres, in/out.
  std::span<Vec3> points;
  std::span<const BundleObservation> observations;
  /// Output: |ε|² inverse_sigma² of each observation at the result; one per observation, or empty.
  std::span<float> squared_residuals;
};

enum class BundleLoss : std::uint8_t { none, huber, cauchy };

/// Knowledge of the length of T_camera_left[k].t, which determines the scale.
enum class BundleLength : std::uint8_t {
  /// t_k = metres · u with u on the sphere, so 5 free parameters; the input's t_k is scaled to that
  /// length.
  exact,
  /// Residual (|t_k| − metres)/sigma, with 6 free parameters.
  measured,
  /// Unknown, with 6 free parameters; another camera must determine the scale.
  free,
};

struct BundleLengthConstraint {
  BundleLength kind = BundleLength::exact;
  /// Length > 0; with `exact`, 0 selects the length of the input.
  double metres = 0;
  /// Standard deviation with `measured`, in metres, > 0.
  double sigma = 0;
};

/// One camera's intrinsics in the adjustment (stereo_calibration only).
struct BundleIntrinsics {
  /// Bit i is set if parameter i is estimated.
  std::uint16_t free = 0;
  /// Mean of the prior of free parameters with prior_sigma > 0.
  std::array<double, kIntrinsicsSize> prior_mean{};
  /// Standard deviation of the prior; 0 for no prior.
  std::array<double, kIntrinsicsSize> prior_sigma{};
  std::array<double, kIntrinsicsSize> held_sigma{
      /// Standard deviation of fixed parameters for the total covariance; negative for the default,
      /// 0.1 % of a focal length and 0.5 px of a principal point.
      -1, -1, -1, -1, 0, 0, 0, 0, 0};
};

/// Prior of θ_S from earlier solves (stereo_calibration only): ½ weight δᵀ C⁻¹ δ over the free
/// parameters.
struct BundleSharedPrior {
  /// Mean and `covariance`; null for no prior. Rows without a variance have no prior.
  const RigCalibration* rig = nullptr;
  /// Factor > 0 by which the solve overweights its tracks, and so the prior.
  double weight = 1;
};

struct BundleOptions {
  BundleConfiguration configuration = BundleConfiguration::stereo_odometry;
  /// Constraint of each camera k ≥ 1 in stereo_calibration.
  std::array<BundleLengthConstraint, kMaxCameras> length{};
  std::array<BundleIntrinsics, kMaxCameras> intrinsics{};
  BundleSharedPrior shared_prior{};
  /// Clusters of the covariance: image cells, this many per side (0 … 8), and blocks of frames;
  /// with 0 each track is a cluster.
  int cells = 0;
  /// Factor > 0 of the clusters' variance, for errors that tracks of one surface share but clusters
  /// do not show.
  double shared_errors = 1;

  BundleLoss loss = BundleLoss::none;
  /// Threshold of Huber's loss or scale of Cauchy's in sigmas, > 0.
  double loss_threshold = 2.0;

  /// Maximum number of solver steps, accepted or not, 1 … 1000.
  int max_steps = 30;
  /// Stops if a step moves the free pose with the highest index and the shared parameters together
  /// by less than this many standard deviations, ≥ 0.
  double tolerance_sigmas = 1e-3;
  /// Initial λ in (0, 1e6], by which diagonals are multiplied as 1 + λ; λ is divided by 10 after a
  /// success and multiplied by 10 after a failure.
  double initial_damping = 1e-4;

  /// Computes the covariances of θ_S (stereo_calibration).
  bool covariance = false;
  /// Computes BundleResult::pose_covariance of the free pose with the highest index; costs as much
  /// as a step.
  bool pose_covariance = false;

  /// True if every field is in its range.
  [[nodiscard]] bool valid() const noexcept;
};

enum class BundleTermination : std::uint8_t {
  /// The last step was below the tolerance, or below rounding.
  converged,
  /// Not converged; the result is the best so far.
  max_steps,
  /// No damping lowers the cost; the result is the best so far.
  diverged,
  /// The problem or options are invalid, or a point is behind its camera at the start; nothing was
  /// changed.
  invalid_input,
  /// The observations do not determine the parameters; unchanged if detected before the first step,
  /// else the best so far.
  rank_deficient,
  /// A capacity of the adjuster is exceeded; nothing was changed.
  capacity,
};

/// Covariances are of the left perturbation (rotation rad, then translation m), R ← Exp(φ) R, t ← t
/// + τ, as in RigCalibration; with an exact length the 6×6 has rank 5.
struct BundleResult {
  /// Eigen does not initialise matrices.
  BundleResult() noexcept {
    for (auto* all : {&covariance_white, &covariance_noise, &covariance_total})
      for (Mat6& m : *all) m.setZero();
  }

  BundleTermination termination = BundleTermination::invalid_input;
  int steps = 0;
  int accepted = 0;
  /// ½ Σ ρ(|ε|²/σ²) plus priors.
  double final_cost = 0;
  /// Root mean of |ε|² over observations, both coordinates together, unweighted.
  double rms_px = 0;

  /// True if covariances were requested and the undamped system is positive definite.
  bool has_covariance = false;
  /// Σ w |ε|²/σ² over the degrees of freedom; 1 if inverse_sigma is correct.
  double sigma0_squared = 0;
  /// Covariance of each T_camera_left[k] as σ̂² H⁻¹.
  std::array<Mat6, kMaxCameras> covariance_white{};
  /// Cluster-robust covariance (`cells`), times shared_errors; priors are not scaled.
  std::array<Mat6, kMaxCameras> covariance_noise{};
  /// covariance_noise plus the uncertainty of fixed intrinsics.
  std::array<Mat6, kMaxCameras> covariance_total{};
  /// Standard deviations of free intrinsics, from covariance_noise.
  std::array<std::array<double, kIntrinsicsSize>, kMaxCameras> intrinsics_sigma{};
  /// Joint covariance_total of θ_S and of fixed but uncertain intrinsics.
  RigCovariance covariance{};
  /// Mean over θ_S of the ratio of the variance by clusters to that by H⁻¹.
  double inflation = 1;

  bool has_pose_covariance = false;
  std::uint16_t pose = 0;
  /// H⁻¹ with inverse_sigma taken as true, marginalised over all other parameters, for R ← Exp(φ)
  /// R, t ← Exp(φ) t + τ.
  Mat6 pose_covariance = Mat6::Zero();

  /// True if the parameters are at a minimum within the tolerance.
  [[nodiscard]] bool converged() const noexcept {
    return termination == BundleTermination::converged;
  }
  /// True if the caller's arrays contain a finite result no worse than the start.
  [[nodiscard]] bool usable() const noexcept { return termination <= BundleTermination::diverged; }
};

struct BundleCapacities {
  /// 1 … kMaxCameras.
  std::size_t cameras = 2;
  std::size_t poses = 12;
  std::size_t points = 500;
  std::size_t observations = 8000;
  /// Room for θ_S; without it stereo_calibration is rejected with `capacity`.
  bool shared = true;
  /// Number of pairs (eight points, pose) with an observation; 0 for the worst case.
  std::size_t blocks = 0;
};

class PairRunner;
namespace detail {
struct BundleWorkspace;
}

/// Partitioned bundle adjustment of Warren et al. (ICRA 2013): Levenberg–Marquardt on U − W P⁻¹ Wᵀ,
/// poses and shared parameters dense.
///
/// Parametrisation  pose: R ← Exp(φ) R, t ← Exp(φ) t + τ (about the camera, so that a distant world
///                  origin costs no precision); camera k: R_k ← R_k Exp(φ), t_k ← t_k + R_k τ, with
///                  `exact` at constant length. Points: X ← X + δ with |δ| at most 0.8 of the
///                  point's minimum depth, so that no point passes through a camera.
///
///     const BundleCapacities capacities{.poses = poses.size(), .points = points.size()};
///     Arena arena;
///     BundleAdjuster adjuster(capacities, arena);
///     BundleProblem problem;
///     problem.cameras = cameras;
///     problem.T_camera_left = T_camera_left;
///     problem.T_left_world = poses;  // in/out; the first is constant
///     problem.points = points;       // in/out
///     problem.observations = observations;
///     const BundleResult result = adjuster.solve(problem, BundleOptions{});  // stereo odometry
///
/// Ownership  The problem's arrays are the caller's; no reference is kept after solve().
/// Threads    solve() by one thread at a time; adjusters are independent of each other. A runner
///            outlives the adjuster.
/// Memory     From the arena at construction, nothing in solve().
/// Time       One pass over the observations per step, at most max_steps. Deterministic on one
///            machine; SIMD targets differ by rounding.
/// Errors     solve() never throws and never returns NaN; the status states what was changed. The
///            constructor throws std::length_error if the arena is too small and
///            std::invalid_argument for invalid capacities.
/// Source     Warren, McKinnon, Upcroft, ICRA 2013, with the corrected order of transforms
///            (core/README.md).
class BundleAdjuster {
 public:
  /// `runner` (optional): linearises half of the points on either thread, which takes a second
  /// reduced system of memory. Results depend on whether there is one, not on its threads.
  BundleAdjuster(const BundleCapacities& capacities, Arena& arena, PairRunner* runner = nullptr);
  [[nodiscard]] BundleResult solve(const BundleProblem& problem,
                                   const BundleOptions& options) noexcept;

 private:
  detail::BundleWorkspace* workspace_;
};

}  // namespace vergence
