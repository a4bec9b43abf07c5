#pragma once
#include <cstdint>

#include "core/types/change_evidence.hpp"
#include "core/types/pose_sample.hpp"

namespace vergence {

/// Event of the estimator, written as a line of events.jsonl. `why` points to a constant.
struct EstimatorEvent {
  /// Kind of an event. Each comment describes `value`, which is 0 for other kinds.
  enum class Kind : std::uint8_t {
    state,
    /// Duration of the gap, in s.
    map_reset,
    /// Duration of the gap, in s.
    time_gap,
    relocalised,
    /// Time by which the frame is older than the previous one, in s.
    dropped,
    /// Number of frames since the onset. Also recorded for a requested calibration.
    rig_changed,
    /// Offset between the cameras' exposures in frames if that explains the changes, else 0.
    rig_not_rigid,
    /// Lag in frames; 0 if unknown.
    out_of_sync,
    cameras_in_sync,
    /// Standard deviation of depths, in percent.
    calibration_verified,
    /// Depth error of the calibration in use, in percent.
    calibration_contradicted,
    /// Measured focal length, in px.
    focal_length_contradicted,
    /// Number of frames in the solve.
    calibration_accepted,
    /// Number of frames in the solve.
    calibration_rejected,
    /// Share of map points that fit the accepted calibration, in percent.
    calibration_applied,
    /// None; `why` names what is missing.
    calibration_pending,
    /// None; the images fit an earlier calibration after tracking was lost.
    calibration_resumed,
  };
  Kind kind = Kind::state;
  Stamp stamp{};
  State from = State::initialising;
  State to = State::initialising;
  const char* why = "";
  double value = 0;
  ChangeEvidence evidence;
};

}  // namespace vergence
