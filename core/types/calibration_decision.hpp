#pragma once
#include <cstdint>
#include <string_view>

#include "core/types/calibration.hpp"
#include "core/types/change_evidence.hpp"

namespace vergence {

/// Why a calibration was sought. One word each: it stands in calibrations.csv and summary.json.
enum class CalibrationCause : std::uint8_t {
  from_scratch,  // there was none
  knock,         // the monitor saw the rig change
  drift,         // the monitor saw it creep
  collapse,      // left and right found hardly any match any more
  out_of_sync,   // a camera's images seem to be of another instant
  requested,     // the user asked
  refinement,    // the drive goes on: what it has shown since is added to what is known
  contradicted,  // the calibration that the drive began with, or went on with, is not that of the
                 // rig
};
[[nodiscard]] std::string_view to_string(CalibrationCause) noexcept;

/// Focal length measured online, compared with the configured one.
struct FocalMeasurement {
  double configured_px = 0;  // fx of the left camera
  double measured_px = 0;    // 0: it has not been measured
  double sigma_px = 0;  // 1 sigma, with what lenses leave; 0: the measurement is not at its end,
                        // and already far from the one given
  bool contradicted = false;  // the one given is certainly not that of the images
};

/// Result of one calibration attempt: a line of calibrations.csv. A value.
struct CalibrationDecision {
  Stamp stamp{};  // of the frame it was decided at
  CalibrationCause cause = CalibrationCause::from_scratch;
  bool accepted = false;
  /// True if a calibration was in use meanwhile. If such a decision is not accepted, the
  /// calibration in use fits as well.
  bool is_refinement = false;
  /// Reason of a rejection, a constant without commas; empty when accepted.
  const char* reason = "";
  /// Calibration found, also when rejected.
  RigCalibration calibration{};
  /// Frames from the alarm, the start or the request to the decision.
  int latency_frames = 0;
  /// First frame of the changed rig; 0: does not apply.
  std::uint64_t onset_frame = 0;
  /// Median distance of held-out frames' matches from their epipolar lines, of the camera that fits
  /// worst, with the calibration before and with this one.
  double held_out_before_px = 0;
  double held_out_after_px = 0;
  /// Depth that the next two errors are of; 0: nothing was measured.
  double reference_depth_m = 0;
  /// Predicted depth error of the calibration found, 1 sigma.
  double depth_sigma_percent = 0;
  /// Depth error of the calibration before, by the one found; 0: there was none.
  double depth_error_percent = 0;
  /// True if depths of the calibration now in use are within the tolerated error.
  bool verified = false;
  /// That the rig is the one of the calibration before, or, with `contradicted`, another one.
  ChangeEvidence evidence;
  /// The newest of the drive.
  FocalMeasurement focal{};
  /// Time on the solver's thread.
  double solve_ms = 0;
};

}  // namespace vergence
