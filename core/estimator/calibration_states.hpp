#pragma once
#include <array>
#include <cstdint>

namespace vergence {

/// State of the calibration in use.
enum class CalibrationState : std::uint8_t {
  /// No calibration is in use; one is being estimated.
  none,
  /// In use, but not yet compared with an online estimate.
  unverified,
  verified,  // in use, and its depths are within the tolerated error
  suspect,   // the rig seems to have changed; another one is sought
};

/// Event that changes the state of the calibration in use.
enum class CalibrationTrigger : std::uint8_t {
  adopted,           // what was sought is found
  adopted_verified,  // the same, by a drive that holds its depths to the tolerated error
  verified,          // by a measurement, while it was in use
  contradicted,      // the same
  suspected,         // an alarm, or a recalibration was requested
  kept,              // what was sought is no better, or the images fit the one before again
};

struct CalibrationTransition {
  CalibrationState from;
  CalibrationTrigger on;
  CalibrationState to;
};

/// All edges; a trigger without an edge from the current state changes nothing.
inline constexpr std::array kCalibrationTransitions = {
    CalibrationTransition{CalibrationState::none, CalibrationTrigger::adopted,
                          CalibrationState::unverified},
    CalibrationTransition{CalibrationState::none, CalibrationTrigger::adopted_verified,
                          CalibrationState::verified},
    CalibrationTransition{CalibrationState::unverified, CalibrationTrigger::verified,
                          CalibrationState::verified},
    CalibrationTransition{CalibrationState::unverified, CalibrationTrigger::suspected,
                          CalibrationState::suspect},
    CalibrationTransition{CalibrationState::verified, CalibrationTrigger::contradicted,
                          CalibrationState::unverified},
    CalibrationTransition{CalibrationState::verified, CalibrationTrigger::suspected,
                          CalibrationState::suspect},
    CalibrationTransition{CalibrationState::suspect, CalibrationTrigger::adopted,
                          CalibrationState::unverified},
    CalibrationTransition{CalibrationState::suspect, CalibrationTrigger::adopted_verified,
                          CalibrationState::verified},
    CalibrationTransition{CalibrationState::suspect, CalibrationTrigger::kept,
                          CalibrationState::unverified},
};

[[nodiscard]] constexpr CalibrationState after(CalibrationState state,
                                               CalibrationTrigger trigger) noexcept {
  for (const CalibrationTransition& t : kCalibrationTransitions)
    if (t.from == state && t.on == trigger) return t.to;
  return state;
}

}  // namespace vergence
