#pragma once
#include <array>
#include <span>

#include "core/calibration/monitor.hpp"
#include "core/calibration/options.hpp"
#include "core/calibration/track_log.hpp"
#include "core/memory/arena.hpp"
#include "core/odometry/options.hpp"
#include "core/types/calibration.hpp"
#include "core/types/calibration_decision.hpp"
#include "core/types/decision_margins.hpp"
#include "core/types/estimator_event.hpp"
#include "core/types/parallel.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence {

/// Origin of the calibration handed to the estimator.
enum class CalibrationTrust : std::uint8_t {
  /// Used from the first frame; poses are `degraded` until it is verified.
  given,
  /// From the last run's state file; handled like `given`.
  state_file,
  /// None: only intrinsics and baseline length of the rig are used.
  none,
};

/// Time at which a solution is adopted or rejected.
enum class Adoption : std::uint8_t {
  /// After a fixed number of frames, for which the estimator waits for the solver: deterministic.
  after_fixed_frames,
  /// As soon as the solver has finished: for live operation.
  when_ready,
};

struct EstimatorOptions {
  OdometryOptions odometry{};
  calibration::CalibrationOptions calibration{};
  calibration::MonitorOptions monitor{};
  CalibrationTrust trust = CalibrationTrust::given;
  Adoption adoption = Adoption::after_fixed_frames;
  /// Mask of each camera, as large as its images; no point is placed where a mask is 0. An empty
  /// view means no mask.
  std::array<ImageView, kMaxCameras> masks{};
  /// Time limit per frame for live operation, above which work is left out (docs/deployment.md);
  /// zero means no limit.
  Duration frame_budget{};
  /// If false, the rig is not monitored and the supplied calibration is used throughout.
  bool online = true;
};

/// Estimates the pose of each rig frame, and calibrates the rig online. This is the entry point of
/// core.
///
///     Arena arena;
///     SequentialRunner runner;
///     Estimator estimator(options, rig, rig, arena, runner, solver);
///     for (RigFrame frame; next_frame(&frame);) {
///       const PoseSample sample = estimator.process(frame);
///       if (sample.status != PoseStatus::lost) use(sample);
///     }
///     estimator.finish();
///
/// Ownership  Keeps references to the arena and the runners; images are read during process() only,
///            masks in the constructor only.
/// Threads    One caller; process() shares the front end's work with `runner` and uses `solver` for
///            calibration in the background. With Adoption::after_fixed_frames, poses do not depend
///            on the runners. request_recalibration(): any thread.
/// Memory     All of it from the arena in the constructor. process() allocates nothing, nor does
///            the solver's task.
/// Errors     The constructor throws (std::invalid_argument with a message, std::length_error).
///            process() never does.
class Estimator {
 public:
  /// `rig`: intrinsics, baseline length and, except with CalibrationTrust::none, T_camera_left.
  /// `nominal`: design values of the rig, which the gates compare a new calibration with
  /// (rig.nominal of the configuration).
  Estimator(const EstimatorOptions& options, const RigCalibration& rig,
            const RigCalibration& nominal, Arena& arena, PairRunner& runner,
            BackgroundRunner& solver);
  ~Estimator();
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;

  /// Estimates the pose of one frame. Stamps must increase strictly: a frame that is not newer
  /// gives `lost` with reason time_gap and changes nothing. An empty image stands for a camera that
  /// gave none. If the frame's pairing is contradicted, only its first image is used, and the pose
  /// is degraded. T_world_left is continuous except across a marked gap.
  [[nodiscard]] PoseSample process(const RigFrame& frame) noexcept;

  /// Call after the last frame. Solves and decides on a calibration that is still being estimated,
  /// using the frames logged so far; events() and calibrations() have the outcome. Waits for the
  /// solver.
  void finish() noexcept;

  /// Requests a new calibration, whatever the monitor's result; acts at the next frame.
  /// Async-signal-safe.
  void request_recalibration() noexcept;

  /// Events of the last process() or finish() call, oldest first; valid until the next call.
  [[nodiscard]] std::span<const EstimatorEvent> events() const noexcept;
  /// Calibrations decided on in the last process() or finish() call, each a line of
  /// calibrations.csv. An accepted one is adopted and belongs in the state file.
  [[nodiscard]] std::span<const CalibrationDecision> calibrations() const noexcept;

  [[nodiscard]] State state() const noexcept;
  /// The calibration in use; before there is one, the supplied rig without T_camera_left.
  [[nodiscard]] const RigCalibration& calibration() const noexcept;
  [[nodiscard]] bool calibrated() const noexcept;
  /// True if the depths of the calibration in use were measured to be within the tolerated error.
  [[nodiscard]] bool verified() const noexcept;
  /// The newest moving frames with their tracks; empty without `online`. Valid until the next
  /// process().
  [[nodiscard]] const calibration::TrackLog& tracks() const noexcept;
  /// Margins of the decisions on the last frame; all 0 for a frame without a pose.
  [[nodiscard]] const DecisionMargins& margins() const noexcept;

 private:
  struct Parts;
  // Constructed in the arena.
  Parts* parts_;
};

}  // namespace vergence
