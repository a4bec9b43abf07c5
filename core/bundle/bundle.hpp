#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/camera/camera.hpp"
#include "core/math/types.hpp"
#include "core/memory/arena.hpp"

namespace vergence {

/// Which blocks of θ = [θ_S | θ_I | θ_P] are free. One code; the configuration is the
/// choice of partition.
enum class BundleConfiguration : std::uint8_t {
  stereo_calibration,  // θ_S: T_camera_left of every camera but 0, and intrinsics if asked; θ_I:
                       // one pose a rig frame
  stereo_odometry,  // θ_S empty: T_camera_left and intrinsics are constant;              θ_I: one
                    // pose a rig frame
  parallel_monocular,  // θ_S empty, T_camera_left is not read;                              θ_I:
                       // one pose an image
};

/// One feature in one image. `x`, `y` in pixels of camera `camera`, through that camera's
/// distortion.
///
/// stereo_*: `pose` is the rig frame and `camera` the camera of the rig: X_camera =
/// T_camera_left[camera] * T_left_world[pose] * X.
/// parallel_monocular: `pose` is the image (left and right images of one rig frame have poses of
/// their own, `T_camera_world`), `camera` only chooses the intrinsics: X_camera =
/// T_left_world[pose] * X.
struct BundleObservation {
  std::uint32_t point = 0;
  std::uint16_t pose = 0;
  std::uint8_t camera = 0;
  float inverse_sigma = 1.0F;  // 1/px, of one coordinate, > 0
  double x = 0, y = 0;         // px; double, because float resolves only 6e-5 px at 1000 px
};

/// Prior of a pose: `information` (rotation, then translation) of the
/// perturbation δ = (φ, τ) that takes the prior's transform to the pose: R = Exp(φ) R₀, t = Exp(φ)
/// t₀ + τ. Adds ½ δᵀ Λ δ to the cost.
struct BundlePosePrior {
  std::uint16_t pose = 0;
  Transform T_left_world{};
  Mat6 information = Mat6::Zero();  // symmetric, positive semidefinite; 1/rad², 1/(rad m), 1/m²
};

/// A problem in the caller's arrays; solve() reads them all and writes those marked in/out.
///
/// Order  Observations are sorted by (point, pose, camera), strictly: a feature appears once.
///        Points without observations are left alone.
struct BundleProblem {
  std::span<Camera> cameras;  // 1 … kMaxCameras; in/out where intrinsics are free, else read only
  std::span<Transform> T_camera_left;  // as many as cameras, [0] the identity; in/out in
                                       // stereo_calibration; may be empty in parallel_monocular
  std::span<Transform> T_left_world;   // poses, in/out
  std::span<const std::uint8_t>
      pose_constant;       // 1: not changed. As many as poses, or empty: only pose 0 is constant
  std::span<Vec3> points;  // world, metres, in/out
  std::span<const std::uint8_t>
      point_constant;  // 1: not changed. As many as points, or empty: none
  std::span<const BundleObservation> observations;
  std::span<const BundlePosePrior> pose_priors;  // of free poses; may be empty
  std::span<float> squared_residuals;  // out: |ε|² inverse_sigma² of each observation at the
                                       // result; as many as observations, or empty
};

enum class BundleLoss : std::uint8_t { none, huber, cauchy };

/// Knowledge of the length of T_camera_left[k].t: it is the scale of everything.
enum class BundleLength : std::uint8_t {
  exact,  // t_k = metres · u, u on the sphere: 5 free parameters for that camera; the input's t_k
          // is brought to that length
  measured,  // residual (|t_k| − metres)/sigma: 6 free parameters
  free,      // nothing: 6 free parameters; some other camera must fix the scale
};

struct BundleLengthConstraint {
  BundleLength kind = BundleLength::exact;
  double metres = 0;  // > 0; 0 with `exact`: the length that T_camera_left comes with
  double sigma = 0;   // m, > 0, with `measured`
};

/// One camera's intrinsics in the adjustment (stereo_calibration only).
struct BundleIntrinsics {
  std::uint16_t free = 0;                             // bit i: parameter i is estimated
  std::array<double, kIntrinsicsSize> prior_mean{};   // used where free and prior_sigma > 0
  std::array<double, kIntrinsicsSize> prior_sigma{};  // 0: no prior
  std::array<double, kIntrinsicsSize> held_sigma{
      -1, -1, -1, -1, 0, 0, 0, 0, 0};  // of what is held, for the wide covariance;
                                       // negative: the default, 0.1 % of a focal length and 0.5 px
                                       // of a principal point
};

/// Prior of θ_S from earlier solves (stereo_calibration only): ½ weight δᵀ C⁻¹ δ over the
/// parameters that are free here.
struct BundleSharedPrior {
  const RigCalibration* rig = nullptr;  // mean and `covariance`; null: nothing is known. Rows
                                        // without a variance: nothing is known of them
  double weight =
      1;  // factor by which the solve overweights its tracks; the prior gets the same, > 0
};

struct BundleOptions {
  BundleConfiguration configuration = BundleConfiguration::stereo_odometry;
  std::array<BundleLengthConstraint, kMaxCameras>
      length{};  // [k] of camera k ≥ 1; read in stereo_calibration
  std::array<BundleIntrinsics, kMaxCameras> intrinsics{};  // read in stereo_calibration
  BundleSharedPrior shared_prior{};
  int cells = 0;  // covariance: clusters are so many cells a side of the image, and blocks of
                  // frames; 0 … 8, 0: each track is one
  double shared_errors = 1;  // times the clusters' variance: what tracks of one surface share and a
                             // cluster a track does not see, > 0
  BundleLoss loss = BundleLoss::none;
  double loss_threshold = 2.0;  // sigmas, > 0; Huber: where it turns linear; Cauchy: scale
  int max_steps = 30;           // solver steps tried, accepted or not, 1 … 1000
  double cost_tolerance =
      1e-6;  // stop when a step changes the cost by less than this share of it, ≥ 0
  double update_tolerance = 1e-10;  // stop when |δ| ≤ tolerance · (|θ| + tolerance), ≥ 0
  double gradient_tolerance = 0;    // stop when the largest component of the reduced gradient, each
                                    // over the root of its diagonal, is below, ≥ 0
  double initial_damping = 1e-4;  // λ of the first step; diagonals × (1 + λ), ÷ 10 after a success,
                                  // × 10 after a failure, in (0, 1e6]
  bool covariance = false;       // fill BundleResult's covariances of θ_S (stereo_calibration)
  bool pose_covariance = false;  // fill BundleResult::pose_covariance, of the free pose with the
                                 // highest index; costs as much as a step

  /// Every field is in its range.
  [[nodiscard]] bool valid() const noexcept;
};

enum class BundleTermination : std::uint8_t {
  small_update,       // converged: |δ| below update_tolerance
  small_gradient,     // converged
  small_cost_change,  // converged
  max_steps,          // stopped on the way; the result is the best so far
  diverged,           // no damping up to the largest lowers the cost; the result is the best so far
  invalid_input,      // options out of range, sizes, indices, order or numbers that cannot be, a
                      // point behind its camera at the start; nothing was changed
  rank_deficient,     // the observations do not determine the parameters; unchanged if found before
                      // the first step, else the best so far
  capacity,           // more of something than the adjuster was built for; nothing was changed
};

/// Covariances are of the left perturbation (rotation rad, then translation m), R ← Exp(φ) R, t ← t
/// + τ, as in RigCalibration; with an exact length the 6×6 has rank 5.
struct BundleResult {
  BundleResult() noexcept {  // Eigen leaves a matrix as it finds the memory
    for (auto* all : {&covariance_white, &covariance_noise, &covariance_total})
      for (Mat6& m : *all) m.setZero();
  }

  BundleTermination termination = BundleTermination::invalid_input;
  int steps = 0;          // tried
  int accepted = 0;       // of these
  double final_cost = 0;  // ½ Σ ρ(|ε|²/σ²) + priors
  double rms_px =
      0;  // root mean of |ε|² over observations, px, both coordinates together, unweighted
  double damping = 0;  // λ at the end

  bool has_covariance = false;  // asked for, and the undamped system is positive definite
  double sigma0_squared = 0;  // Σ w |ε|²/σ² over the degrees of freedom: 1 if inverse_sigma is true
  std::array<Mat6, kMaxCameras> covariance_white{};  // [k] of T_camera_left[k]: σ̂² H⁻¹
  std::array<Mat6, kMaxCameras>
      covariance_noise{};  // cluster-robust (`cells`), times shared_errors; priors as they are
  std::array<Mat6, kMaxCameras>
      covariance_total{};  // covariance_noise + what the held intrinsics may be off by
  std::array<std::array<double, kIntrinsicsSize>, kMaxCameras>
      intrinsics_sigma{};  // of the free ones, from covariance_noise
  RigCovariance
      covariance{};  // covariance_total of all of θ_S together, with what is held but uncertain
  double inflation = 1;  // mean over θ_S of the variance by clusters over the one by H⁻¹

  bool has_pose_covariance = false;
  std::uint16_t pose = 0;               // whose
  Mat6 pose_covariance = Mat6::Zero();  // H⁻¹ (inverse_sigma taken as true) with all else that is
                                        // free marginalised, of R ← Exp(φ) R, t ← Exp(φ) t + τ

  /// The parameters are at a minimum, to within the tolerances.
  [[nodiscard]] bool converged() const noexcept {
    return termination <= BundleTermination::small_cost_change;
  }
  /// The caller's arrays hold a finite result no worse than the start.
  [[nodiscard]] bool usable() const noexcept { return termination <= BundleTermination::diverged; }
};

struct BundleCapacities {
  std::size_t cameras = 2;  // 1 … kMaxCameras
  std::size_t poses = 12;
  std::size_t points = 500;
  std::size_t observations = 8000;
  bool shared = true;  // room for θ_S; false: stereo_calibration is refused with `capacity`
  std::size_t blocks =
      0;  // pairs (eight points | pose) with an observation; 0: the worst case of the sizes above
};

namespace detail {
struct BundleWorkspace;
}

/// Partitioned bundle adjustment of Warren et al. (ICRA 2013): Levenberg–Marquardt on U − W P⁻¹ Wᵀ,
/// poses and shared parameters dense.
///
/// Parametrisation  pose: R ← Exp(φ) R, t ← Exp(φ) t + τ (about the camera, so that a far-away
///            world origin costs no digits); camera k: R_k ← R_k Exp(φ), t_k ← t_k + R_k τ, with
///            `exact` t_k kept at its length. Points: X ← X + δ, |δ| at most 0.8 of the point's
///            least depth, so that no point passes through a camera.
///
///     const BundleCapacities capacities{.poses = poses.size(), .points = points.size()};
///     Arena arena(BundleAdjuster::memory_needed(capacities));
///     BundleAdjuster adjuster(capacities, arena);
///     BundleProblem problem;
///     problem.cameras = cameras;
///     problem.T_camera_left = T_camera_left;
///     problem.T_left_world = poses;  // in/out; the first is held
///     problem.points = points;       // in/out
///     problem.observations = observations;
///     const BundleResult result = adjuster.solve(problem, BundleOptions{});  // stereo odometry
///
/// Ownership  The problem's arrays are the caller's; nothing of them is kept after solve().
/// Threads    solve() by one thread at a time; adjusters are independent of each other.
/// Memory     memory_needed() bytes of the arena at construction, nothing in solve().
/// Time       One pass over the observations a step; bounded by max_steps. Deterministic on one
///            machine; between SIMD targets results agree to the rounding of sums.
/// Errors     solve() never throws and never leaves a NaN; the status states what was changed. The
///            constructor throws std::length_error if the arena is too small and
///            std::invalid_argument for impossible capacities.
/// Source     Warren, McKinnon, Upcroft, ICRA 2013, with the corrected order of transforms
///            (core/README.md).
class BundleAdjuster {
 public:
  BundleAdjuster(const BundleCapacities& capacities, Arena& arena);
  [[nodiscard]] BundleResult solve(const BundleProblem& problem,
                                   const BundleOptions& options) noexcept;
  [[nodiscard]] static std::size_t memory_needed(const BundleCapacities& capacities) noexcept;

 private:
  detail::BundleWorkspace* workspace_;
};

}  // namespace vergence
