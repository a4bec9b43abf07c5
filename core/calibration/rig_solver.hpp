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
  too_few_tracks,  // hardly a point was seen by both cameras in two frames
  no_candidate,    // in no frame the cameras' own poses were found
  not_converged,
  not_observable,  // converged, but the tracks leave some direction of the transform open
};

/// Prior sigma of every focal length in a solve with `measure_focal_lengths`, as a share of it.
inline constexpr double kFocalPriorSigma = 0.1;

/// Start, prior and free parameters of a solve. `known` and `given` are read during solve() only.
/// CalibrationOptions::intrinsics chooses the intrinsics that are estimated with the transforms:
/// with `full`, those of the further cameras and the distortion of all.
struct RigSolveRequest {
  RigCalibration rig{};  // cameras, intrinsics, baseline; T_camera_left with from_rig
  /// Also estimates every focal length with the prior sigma kFocalPriorSigma, the left camera's
  /// included.
  bool measure_focal_lengths = false;
  bool from_rig = false;  // begin with T_camera_left of `rig`; false: with those of the logged
                          // frame that fits best
  const RigCalibration* known =
      nullptr;  // posterior of earlier frames with its covariance; null: none
  const RigCalibration* given = nullptr;  // whose lenses and sigmas are the priors where nothing is
                                          // known; null: those of `rig`
};

struct RigSolution {
  RigSolveStatus status = RigSolveStatus::too_few_tracks;
  RigCalibration rig{};  // the result: transforms, sigmas, intrinsics where they were estimated,
                         // frames, rms, scale_sigma
  std::uint64_t newest = 0;  // number of the newest frame used
  int frames = 0;
  int tracks = 0;
  int observations = 0;
  int steps = 0;
  int near = 0;                  // tracks nearer than CalibrationOptions::near_baselines
  double travelled_m = 0;        // along the frames used
  int lag_frames = 0;            // that the images of a camera are late, else 0
  std::uint64_t changed_at = 0;  // frame since which the tracks are of another transform than
                                 // before, the latest of all cameras; 0: they are of one
  double solve_ms = 0;           // wall time
};

/// Estimates the calibration from a snapshot of the track log: chooses the frame whose
/// transforms fit best, re-initialises the further cameras through them, triangulates the points
/// and adjusts everything with transforms shared by all frames. Sigmas are computed for noise alone
/// and in total.
///
///     RigSolver solver(options, monitor, 2, features, arena);
///     solver.log().begin(frame);  // of each posed frame, and what it saw
///     for (const LoggedObservation& seen : observations) solver.log().push(seen);
///     const RigSolution solution = solver.solve(rig);
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
  [[nodiscard]] static std::size_t memory_needed(const CalibrationOptions& options,
                                                 const MonitorOptions& monitor, int cameras,
                                                 std::size_t features) noexcept;

  [[nodiscard]] TrackLog& log() noexcept { return log_; }
  [[nodiscard]] RigSolution solve(const RigSolveRequest& request) noexcept;
  [[nodiscard]] RigSolution solve(const RigCalibration& rig) noexcept {
    return solve(RigSolveRequest{rig});
  }

 private:
  struct Reference {
    std::uint32_t track;
    std::uint16_t frame;
    std::uint16_t observation;
  };
  [[nodiscard]] static Vec2 pixel_of(const LoggedObservation& s, int k) noexcept {
    return s.raw[static_cast<std::size_t>(k)].cast<double>();
  }
  [[nodiscard]] static BundleCapacities capacities(const CalibrationOptions& options, int cameras,
                                                   std::size_t features) noexcept;
  [[nodiscard]] bool choose_candidate(const RigCalibration& rig) noexcept;
  [[nodiscard]] bool begin_with(const RigSolveRequest& request) noexcept;
  void choose_frames() noexcept;
  void sort_tracks() noexcept;
  void make_points() noexcept;
  void hold_pieces() noexcept;
  [[nodiscard]] bool add_point(std::span<const Reference> track) noexcept;
  [[nodiscard]] BundleOptions options_of(const RigSolveRequest& request) const noexcept;
  [[nodiscard]] BundleResult adjust_robustly(BundleOptions how, int max_steps,
                                             RigSolution* s) noexcept;
  [[nodiscard]] BundleResult adjust(const BundleOptions& how) noexcept;
  [[nodiscard]] double residual_scale() noexcept;
  void drop_outliers(double limit) noexcept;
  void write_result(const BundleResult& r, RigSolution* s) const noexcept;
  void describe(RigSolution* s) const noexcept;
  /// Relative sigma by the noise of the tracks of the length driven, in the last piece that tracks
  /// tie together.
  [[nodiscard]] double length_noise(const BundleResult& r) const noexcept;
  void watch_frames(RigSolution* s) noexcept;
  /// Result of running the monitors of one camera over the frames used, with the solution as the
  /// reference.
  struct Watch {
    int lag_frames = 0;
    std::uint64_t changed_at = 0;
  };
  [[nodiscard]] Watch watch_camera(int k, const RigCalibration& rig) noexcept;

  const CalibrationOptions& options_;
  TrackLog log_;
  BundleAdjuster adjuster_;
  Monitor monitor_;
  double expected_scatter_px_;
  PairingEvidence pairing_;
  DisparityJumpDetector jumps_;
  std::size_t max_frames_;
  std::array<Camera, kMaxCameras> cameras_{};
  std::array<Transform, kMaxCameras> T_camera_left_{};
  int count_ = 0;  // cameras
  BoundedVector<Transform> poses_;
  BoundedVector<std::uint8_t> held_;  // 1: the pose begins a piece that no track ties to the rest
  std::span<int> ties_;               // scratch of hold_pieces()
  BoundedVector<std::uint16_t> logged_;  // index in the log of each pose
  BoundedVector<Vec3> points_;
  BoundedVector<BundleObservation> observations_;
  BoundedVector<Reference> references_;
  BoundedVector<StereoObservation> stereo_;
  std::span<float> residuals_, sorted_;
};

}  // namespace vergence::calibration
