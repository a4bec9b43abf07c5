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
  /// In use, and its depths are within the tolerated error.
  verified,
  /// The rig seems to have changed; another calibration is being estimated.
  suspect,
};

/// Event that can change the state of the calibration in use.
enum class CalibrationTrigger : std::uint8_t {
  /// An estimated calibration is adopted.
  adopted,
  /// An estimated calibration is adopted whose depths are within the tolerated error.
  adopted_verified,
  /// An online estimate verified the calibration in use.
  verified,
  /// An online estimate contradicts the calibration in use.
  contradicted,
  /// The monitor raised an alarm, or a recalibration was requested.
  suspected,
  /// The estimate is no better than the calibration in use, or the images fit an earlier one again.
  kept,
};

struct CalibrationTransition {
  CalibrationState from;
  CalibrationTrigger on;
  CalibrationState to;
};

/// All edges of the state machine; a trigger without an edge from the current state changes
/// nothing.
inline constexpr auto kCalibrationTransitions = [] {
  using S = CalibrationState;
  using T = CalibrationTrigger;
  return std::to_array<CalibrationTransition>({
      {S::none, T::adopted, S::unverified},
      {S::none, T::adopted_verified, S::verified},
      {S::unverified, T::verified, S::verified},
      {S::unverified, T::suspected, S::suspect},
      {S::verified, T::contradicted, S::unverified},
      {S::verified, T::suspected, S::suspect},
      {S::suspect, T::adopted, S::unverified},
      {S::suspect, T::adopted_verified, S::verified},
      {S::suspect, T::kept, S::unverified},
  });
}();

[[nodiscard]] constexpr CalibrationState next_state(CalibrationState state,
                                                    CalibrationTrigger trigger) noexcept {
  for (const CalibrationTransition& t : kCalibrationTransitions)
    if (t.from == state && t.on == trigger) return t.to;
  return state;
}

}  // namespace vergence
