#pragma once
#include <array>
#include <cstddef>
#include <memory>
#include <span>

#include "core/calibration/monitor.hpp"
#include "core/calibration/options.hpp"
#include "core/calibration/track_log.hpp"
#include "core/memory/arena.hpp"
#include "core/odometry/options.hpp"
#include "core/types/calibration.hpp"
#include "core/types/calibration_decision.hpp"
#include "core/types/parallel.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence {

/// Origin of the calibration handed to the estimator.
enum class CalibrationTrust : std::uint8_t {
  given,       // in use from the first frame; poses are `degraded` until it is verified
  state_file,  // from the state file of the last run: handled like `given`
  none,        // from scratch: only intrinsics and baseline length of the rig are read
};

/// Time at which a solution is adopted or rejected.
enum class Adoption : std::uint8_t {
  after_fixed_frames,  // deterministic: the estimator waits for the solver
  when_ready,          // live: when the solver has finished
};

struct EstimatorOptions {
  OdometryOptions odometry{};
  calibration::CalibrationOptions calibration{};
  calibration::MonitorOptions monitor{};
  CalibrationTrust trust = CalibrationTrust::given;
  Adoption adoption = Adoption::after_fixed_frames;
  /// By camera, of its images' size; no point is placed where a mask is 0. Empty: no mask.
  std::array<ImageView, kMaxCameras> masks{};
  /// Live: time of a frame above which work is left out (docs/deployment.md); zero: no limit.
  Duration frame_budget{};
  /// False: the rig is not monitored, and the calibration given is used throughout.
  bool online = true;
};

/// Event of the estimator: a line of events.jsonl. `why` points to a constant.
struct EstimatorEvent {
  /// The comment names the unit of `value`; where there is none it is 0.
  enum class Kind : std::uint8_t {
    state,
    map_reset,  // s, of the gap
    time_gap,   // s
    relocalised,
    dropped,                    // s that the frame is older than the one before
    rig_changed,                // frames since the onset; also when a calibration was requested
    out_of_sync,                // lag in frames; 0 if it is not known
    cameras_in_sync,            // after out_of_sync
    calibration_verified,       // sigma of the depth, percent
    calibration_contradicted,   // depth error of the one in use, percent
    focal_length_contradicted,  // focal length measured, px
    calibration_accepted,       // frames it was solved from
    calibration_rejected,       // frames it was solved from
    calibration_taken_up,  // share of the map's points that fit the calibration accepted, percent
    calibration_pending,   // `why` names what is missing
    calibration_resumed,   // tracking was lost, and the images fit an earlier calibration
  };
  Kind kind = Kind::state;
  Stamp stamp{};
  State from = State::initialising;
  State to = State::initialising;
  const char* why = "";
  double value = 0;
  /// Of a change, a verification or a contradiction that was measured.
  ChangeEvidence evidence;
};

/// Estimates the pose of each rig frame, and the rig's calibration while it drives. This is the
/// entry point of core.
///
///     Arena arena(Estimator::memory_needed(options, rig));
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
/// Threads    One caller; process() uses `runner` for the other images' front end and `solver` for
///            calibration, which runs beside the frames. Same poses whatever the runners, with
///            Adoption::after_fixed_frames. request_recalibration(): any thread.
/// Memory     All of it from the arena in the constructor. process() allocates nothing, nor does
///            the solver's task.
/// Errors     The constructor throws (std::invalid_argument with a message, std::length_error).
///            process() never does.
class Estimator {
 public:
  /// Bytes that the arena must have free for these options and this rig.
  [[nodiscard]] static std::size_t memory_needed(const EstimatorOptions& options,
                                                 const RigCalibration& rig);

  /// `rig`: intrinsics, baseline length and, but for CalibrationTrust::none, T_camera_left.
  /// `nominal`: what the gates compare a new calibration with (rig.nominal of the configuration).
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

  /// Call after the last frame. Solves for and decides about a calibration that is still being
  /// estimated, from the frames there are; events() and calibrations() have the outcome. Waits for
  /// the solver.
  void finish() noexcept;

  /// Requests a new calibration, whatever the monitor's result; acts at the next frame.
  /// Async-signal-safe.
  void request_recalibration() noexcept;

  /// Events of the last process() or finish() call, oldest first; valid until the next call.
  [[nodiscard]] std::span<const EstimatorEvent> events() const noexcept;
  /// Calibrations decided about in the last process() or finish() call, each a line of
  /// calibrations.csv. An accepted one is in use from then on and belongs into the state file.
  [[nodiscard]] std::span<const CalibrationDecision> calibrations() const noexcept;

  [[nodiscard]] State state() const noexcept;
  /// The calibration in use; before there is one, the rig given, without T_camera_left.
  [[nodiscard]] const RigCalibration& calibration() const noexcept;
  [[nodiscard]] bool calibrated() const noexcept;
  /// True if depths of the calibration in use were measured to be within the tolerated error
  ///.
  [[nodiscard]] bool verified() const noexcept;
  /// The newest moving frames with their tracks; empty without `online`. Valid until the next
  /// process().
  [[nodiscard]] const calibration::TrackLog& tracks() const noexcept;

 private:
  struct Parts;
  Parts* parts_;  // in the arena
};

}  // namespace vergence
