#pragma once
#include <cstdint>
#include <string_view>

#include "core/types/calibration.hpp"
#include "core/types/change_evidence.hpp"

namespace vergence {

/// Cause of an estimation; its name is written to calibrations.csv and summary.json.
enum class CalibrationCause : std::uint8_t {
  /// There was no calibration.
  from_scratch,
  /// The monitor detected a sudden change of the rig.
  knock,
  /// The monitor detected a slow change of the rig.
  drift,
  /// Hardly any stereo match was found any more.
  collapse,
  /// A camera's images seem to be from another instant.
  out_of_sync,
  /// A recalibration was requested.
  requested,
  /// New frames refine the calibration in use.
  refinement,
  /// The calibration in use is not that of the rig.
  contradicted,
};
[[nodiscard]] std::string_view to_string(CalibrationCause) noexcept;

/// Focal length measured online, compared with the configured one.
struct FocalMeasurement {
  double configured_px = 0;
  /// Measured fx; 0 if not measured.
  double measured_px = 0;
  /// Standard deviation including systematic lens errors; 0 if the solve has not converged but is
  /// already far from the configured value.
  double sigma_px = 0;
  /// True if the measurement is more probable with another focal length than with the configured
  /// one. Nothing is verified then, because the focal length scales all distances.
  bool doubted = false;
  /// True if the configured value certainly does not fit the images; `doubted` is then true as
  /// well.
  bool contradicted = false;
};

/// Result of one calibration attempt: a line of calibrations.csv. A value.
struct CalibrationDecision {
  /// Stamp of the frame in which the decision was made.
  Stamp stamp{};
  CalibrationCause cause = CalibrationCause::from_scratch;
  bool accepted = false;
  /// True if this refines a calibration in use, which fits as well if the decision is not accepted.
  bool is_refinement = false;
  /// Reason of a rejection, a constant without commas; empty when accepted.
  const char* reason = "";
  /// Estimated calibration, also when rejected.
  RigCalibration calibration{};

  /// Number of frames from the alarm, start or request to the decision.
  int latency_frames = 0;
  /// Number of the first frame of the changed rig; 0 if not applicable.
  std::uint64_t onset_frame = 0;

  /// Median distance of held-out frames' matches from their epipolar lines for the camera that fits
  /// worst, with the previous calibration and with the estimate.
  double held_out_before_px = 0;
  double held_out_after_px = 0;

  /// Depth at which the next two errors are evaluated; 0 if they were not.
  double reference_depth_m = 0;
  /// Predicted depth error of the estimate, 1 sigma.
  double depth_sigma_percent = 0;
  /// Depth error of the previous calibration relative to the estimate; 0 if there was none.
  double depth_error_percent = 0;

  /// True if the depths of the calibration now in use are within the tolerated error.
  bool verified = false;
  /// Evidence that the rig is that of the previous calibration or, with `contradicted`, another
  /// one.
  ChangeEvidence evidence;
  /// Log odds for the previous calibration over those that decide: Assessment::certainty.
  double certainty = 0;
  FocalMeasurement focal{};
  /// True if the rig changed during the frames of this solve and of the one before it.
  bool not_rigid = false;
  /// Fraction of a frame that a camera's images are late (negative: early), if that explains most
  /// of the changes of its transform during the solve's frames, else 0.
  double offset_frames = 0;
  /// Time that the solve took on the solver's thread.
  double solve_ms = 0;
};

}  // namespace vergence
