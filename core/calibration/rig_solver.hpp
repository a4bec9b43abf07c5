#pragma once
#include <array>

#include "core/bundle/bundle.hpp"
#include "core/calibration/disparity_jump.hpp"
#include "core/calibration/monitor.hpp"
#include "core/calibration/options.hpp"
#include "core/calibration/pairing_evidence.hpp"
#include "core/calibration/track_log.hpp"
#include "core/memory/arena.hpp"

namespace vergence::calibration {

enum class RigSolveStatus : std::uint8_t {
  ok,
  /// Hardly any point was seen by both cameras in two frames.
  too_few_tracks,
  /// The cameras' own poses were found in no frame.
  no_candidate,
  not_converged,
  /// The solve converged, but the tracks do not determine all directions of the transform.
  not_observable,
};

/// Relative prior sigma of every focal length that RigSolver::free_focal_lengths() estimates.
inline constexpr double kFocalPriorSigma = 0.1;

/// Start, prior and free parameters of a solve. `known` and `given` are read during solve() only.
/// CalibrationOptions::intrinsics selects the intrinsics that are estimated.
struct RigSolveRequest {
  /// Cameras, intrinsics and baseline; with from_rig also T_camera_left.
  RigCalibration rig{};
  /// True: start from T_camera_left of `rig`. False: start from that of the logged frame that fits
  /// best.
  bool from_rig = false;
  /// Posterior of earlier frames with its covariance; null if there is none.
  const RigCalibration* known = nullptr;
  /// Calibration whose intrinsics and sigmas are the priors where `known` has none; null: `rig`.
  const RigCalibration* given = nullptr;
};

struct RigSolution {
  RigSolveStatus status = RigSolveStatus::too_few_tracks;
  /// Result: transforms, sigmas, estimated intrinsics, frames, rms and scale_sigma.
  RigCalibration rig{};
  std::uint64_t newest = 0;
  int frames = 0;
  int tracks = 0;

  /// Number of tracks nearer than CalibrationOptions::near_baselines.
  int near = 0;
  double travelled_m = 0;

  /// Number of frames that a camera's images are late, else 0.
  int lag_frames = 0;
  /// Fraction of a frame that a camera's images are late (negative: early), if that explains most
  /// of the changes of its transform during the frames used, else 0.
  double offset_frames = 0;
  /// Number of the first frame after the latest change of any camera during the frames used; 0 if
  /// the rig did not change.
  std::uint64_t changed_at = 0;
  double solve_ms = 0;
};

/// Estimates the calibration from the track log: chooses the frame whose transforms fit best,
/// places the additional cameras by them, triangulates the points and runs a bundle adjustment with
/// transforms shared by all frames. Sigmas are computed for noise alone and in total.
///
///     RigSolver solver(options, monitor, 2, features, arena);
///     solver.log().begin(frame);  // each posed frame and its observations
///     for (const LoggedObservation& seen : observations) solver.log().push(seen);
///     const RigSolution solution = solver.solve({.rig = rig});
///     if (solution.status == RigSolveStatus::ok) use(solution.rig, solution.rig.covariance);
///
/// Threads  log() is filled by the estimator's thread while no solve runs; solve() runs on the
///          solver's.
/// Memory   All from the arena at construction. Time: bounded; some hundred milliseconds for 60
///          frames of 500 tracks.
/// Errors   By status; a solution that is not `ok` has no calibration to use.
class RigSolver {
 public:
  RigSolver(const CalibrationOptions& options, const MonitorOptions& monitor, int cameras,
            std::size_t features, Arena& arena);

  [[nodiscard]] TrackLog& log() noexcept { return log_; }
  [[nodiscard]] RigSolution solve(const RigSolveRequest& request) noexcept;
  /// Continues the last solve(), which was of `request` and successful, with every focal length
  /// free, including the left camera's, and without `request.known`, which assumes them.
  [[nodiscard]] RigSolution free_focal_lengths(RigSolveRequest request) noexcept;

 private:
  struct Reference {
    std::uint32_t track;
    std::uint16_t frame;
    std::uint16_t observation;
  };
  /// Sets T_camera_left_ to the request's, or to those of the logged frame that fits best.
  [[nodiscard]] bool place_cameras(const RigSolveRequest& request) noexcept;
  void choose_frames() noexcept;
  void make_points() noexcept;
  [[nodiscard]] bool add_point(std::span<const Reference> track) noexcept;
  void hold_pieces() noexcept;
  [[nodiscard]] BundleOptions bundle_options(const RigSolveRequest& request,
                                             bool focal_lengths) const noexcept;
  [[nodiscard]] BundleResult adjust(const BundleOptions& how) noexcept;
  [[nodiscard]] BundleResult adjust_robustly(BundleOptions how) noexcept;
  /// Removes the outliers of the last adjustment and adjusts again with Cauchy's loss, until a step
  /// is at most `tolerance_sigmas` standard deviations by white noise. `last`: with covariances,
  /// and with enough steps for that.
  [[nodiscard]] BundleResult readjust(BundleOptions how, bool last,
                                      double tolerance_sigmas) noexcept;
  void drop_outliers(double limit) noexcept;
  /// Sets status, rig and sigmas. Returns true if they can be used.
  bool finish(const BundleResult& r, RigSolution* s) noexcept;
  void describe(RigSolution* s) const noexcept;
  /// Relative sigma of the path length by the noise of the tracks, in the last connected piece.
  [[nodiscard]] double length_noise(const BundleResult& r) const noexcept;
  void watch_frames(std::size_t k, RigSolution* s) noexcept;

  const CalibrationOptions& options_;
  TrackLog log_;
  BundleAdjuster adjuster_;
  Monitor monitor_;
  double expected_scatter_px_;
  PairingEvidence pairing_;
  DisparityJumpDetector jumps_;
  std::array<Camera, kMaxCameras> cameras_{};
  std::array<Transform, kMaxCameras> T_camera_left_{};
  std::size_t count_;
  BoundedVector<Transform> poses_;
  // Per pose, 1 if it begins a piece that no track connects to earlier poses.
  std::span<std::uint8_t> held_;
  // Buffer of hold_pieces().
  std::span<int> ties_;
  // Index of each pose in the log.
  BoundedVector<std::uint16_t> logged_;
  BoundedVector<Vec3> points_;
  BoundedVector<BundleObservation> observations_;
  BoundedVector<Reference> references_;
  BoundedVector<StereoObservation> stereo_;
  std::span<float> residuals_, sorted_;
};

}  // namespace vergence::calibration
