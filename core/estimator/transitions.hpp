#pragma once
#include <array>

#include "core/types/pose_sample.hpp"

namespace vergence {

/// Event that can change the estimator's state.
enum class Trigger : std::uint8_t {
  /// A calibration is supplied at the start.
  calibration_given,
  /// The first stereo pair gave the transform between the cameras.
  pair_found,
  /// Enough tracks are logged to calibrate from.
  frames_enough,
  /// The solution passed the gates.
  calibration_accepted,
  /// A gate rejected the solution.
  calibration_rejected,
  /// The solution is no better than the calibration in use.
  calibration_kept,
  /// The monitor detected a change of the rig.
  rig_changed,
  /// A recalibration was requested.
  requested,
  pose_lost,
  /// A pose was found while a calibration is in use.
  pose_found,
  /// A pose was found while the calibration in use is suspect.
  pose_found_suspect,
  /// A pose was found without a calibration.
  pose_found_uncalibrated,
};

/// One edge of the state machine; `why` is written to events.jsonl unchanged.
struct Transition {
  State from;
  Trigger on;
  State to;
  const char* why;
};

/// All edges of the state machine.
inline constexpr std::array kTransitions = {
    Transition{State::initialising, Trigger::calibration_given, State::stereo_odometry,
               "a calibration is supplied"},
    Transition{State::initialising, Trigger::pair_found, State::parallel_monocular,
               "the first pair gave the initial extrinsics"},
    Transition{State::parallel_monocular, Trigger::frames_enough, State::calibrating,
               "enough frames to calibrate from"},
    Transition{State::parallel_monocular, Trigger::pose_lost, State::lost,
               "no pose for three frames"},
    Transition{State::calibrating, Trigger::calibration_accepted, State::stereo_odometry,
               "the calibration is accepted"},
    Transition{State::calibrating, Trigger::calibration_rejected, State::parallel_monocular,
               "the calibration is rejected"},
    Transition{State::calibrating, Trigger::pose_lost, State::lost, "no pose for three frames"},
    Transition{State::stereo_odometry, Trigger::rig_changed, State::recalibrating,
               "the rig no longer fits its calibration"},
    Transition{State::stereo_odometry, Trigger::requested, State::recalibrating,
               "a recalibration was requested"},
    Transition{State::stereo_odometry, Trigger::pose_lost, State::lost, "no pose for three frames"},
    Transition{State::recalibrating, Trigger::calibration_accepted, State::stereo_odometry,
               "the new calibration is accepted"},
    Transition{State::recalibrating, Trigger::calibration_kept, State::stereo_odometry,
               "the calibration in use fits as well as a new one"},
    Transition{State::recalibrating, Trigger::pose_lost, State::lost, "no pose for three frames"},
    Transition{State::lost, Trigger::pose_found, State::stereo_odometry, "relocalised"},
    Transition{State::lost, Trigger::pose_found_suspect, State::recalibrating,
               "relocalised; the rig is still suspect"},
    Transition{State::lost, Trigger::pose_found_uncalibrated, State::initialising,
               "relocalised, without a calibration"},
};

/// Returns the edge of this trigger in this state, or nullptr if the trigger has no effect.
[[nodiscard]] constexpr const Transition* find_transition(State state, Trigger trigger) noexcept {
  for (const Transition& t : kTransitions)
    if (t.from == state && t.on == trigger) return &t;
  return nullptr;
}

consteval bool transitions_are_deterministic() {
  for (const Transition& t : kTransitions)
    if (find_transition(t.from, t.on) != &t) return false;
  return true;
}
static_assert(transitions_are_deterministic(),
              "a row hides another with the same state and trigger");

}  // namespace vergence
