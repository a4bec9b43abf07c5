#pragma once
#include <array>

#include "core/types/pose_sample.hpp"

namespace vergence {

/// Event that can change the estimator's state.
enum class Trigger : std::uint8_t {
  calibration_given,     // one is in use from the first frame
  pair_found,            // the first pair gave the cameras' transform
  frames_enough,         // the tracks since then are thought to hold a calibration
  calibration_accepted,  // through the gates
  calibration_rejected,  // not through
  calibration_saved,     // a new one is no better than the one in use
  rig_changed,           // the monitor raised
  requested,             // a recalibration was requested
  pose_lost,
  pose_found,               // with a calibration in use
  pose_found_suspect,       // with one in use that is suspect
  pose_found_uncalibrated,  // without one
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
    Transition{State::recalibrating, Trigger::calibration_saved, State::stereo_odometry,
               "the calibration in use fits as well as a new one"},
    Transition{State::recalibrating, Trigger::pose_lost, State::lost, "no pose for three frames"},
    Transition{State::lost, Trigger::pose_found, State::stereo_odometry, "relocalised"},
    Transition{State::lost, Trigger::pose_found_suspect, State::recalibrating,
               "relocalised; the rig is still suspect"},
    Transition{State::lost, Trigger::pose_found_uncalibrated, State::initialising,
               "relocalised, without a calibration"},
};

/// Returns the edge of this trigger in this state; nullptr if there is none, and nothing happens.
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
