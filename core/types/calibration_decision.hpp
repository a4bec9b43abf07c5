#pragma once
#include <cstdint>
#include <string_view>

#include "core/types/calibration.hpp"

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
  bool is_refinement = false;  // measured while the drive went on: not accepted is no rejection,
                               // what is in use fits as well
  const char* reason =
      "";  // why it was rejected, a constant message without commas; empty when accepted
  RigCalibration calibration{};   // the one found, also when rejected
  int latency_frames = 0;         // from the alarm (or the start, or the request) to here
  std::uint64_t onset_frame = 0;  // when the rig is thought to have changed; 0: does not apply
  double held_out_before_px = 0;  // distance to the epipolar lines of frames that were not in the
                                  // solve, median, of the camera that fits worst: with the one
                                  // before
  double held_out_after_px = 0;   // and with this one
  double reference_depth_m =
      0;  // METHOD §6.4: the depth that the next three are of; 0: nothing was measured
  double depth_sigma_percent = 0;  // predicted depth error of the calibration found, 1 sigma
  double depth_error_percent =
      0;                     // how far off the one before was, by the one found; 0: there was none
  bool verified = false;     // the calibration now in use holds to the tolerated depth error
  FocalMeasurement focal{};  // the newest of the drive
  double solve_ms = 0;       // on the solver's thread
};

}  // namespace vergence
