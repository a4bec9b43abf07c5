#pragma once
#include <array>

#include "core/types/pose_sample.hpp"

namespace vergence {

/// What can happen to the running system (METHOD §3).
enum class Trigger : std::uint8_t { calibration_given, pose_lost, pose_found };

/// One edge of the state machine; `why` goes to events.jsonl as it stands.
struct Transition {
  State from;
  Trigger on;
  State to;
  const char* why;
};

/// All edges there are. Online calibration adds its own.
inline constexpr std::array kTransitions = {
    Transition{State::initialising, Trigger::calibration_given, State::stereo_odometry, "a calibration is given"},
    Transition{State::stereo_odometry, Trigger::pose_lost, State::lost, "no pose for three frames"},
    Transition{State::lost, Trigger::pose_found, State::stereo_odometry, "a pose again"},
};

/// The row that fires, or nullptr: the trigger means nothing in this state and nothing happens.
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
static_assert(transitions_are_deterministic(), "a row hides another with the same state and trigger");

}  // namespace vergence
