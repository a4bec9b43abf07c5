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
inline constexpr auto kTransitions = [] {
  using S = State;
  using T = Trigger;
  return std::to_array<Transition>({
      {S::initialising, T::calibration_given, S::stereo_odometry, "a calibration is supplied"},
      {S::initialising, T::pair_found, S::parallel_monocular,
       "the first pair gave the initial extrinsics"},
      {S::parallel_monocular, T::frames_enough, S::calibrating, "enough frames to calibrate from"},
      {S::parallel_monocular, T::pose_lost, S::lost, "no pose for three frames"},
      {S::calibrating, T::calibration_accepted, S::stereo_odometry, "the calibration is accepted"},
      {S::calibrating, T::calibration_rejected, S::parallel_monocular,
       "the calibration is rejected"},
      {S::calibrating, T::pose_lost, S::lost, "no pose for three frames"},
      {S::stereo_odometry, T::rig_changed, S::recalibrating,
       "the rig no longer fits its calibration"},
      {S::stereo_odometry, T::requested, S::recalibrating, "a recalibration was requested"},
      {S::stereo_odometry, T::pose_lost, S::lost, "no pose for three frames"},
      {S::recalibrating, T::calibration_accepted, S::stereo_odometry,
       "the new calibration is accepted"},
      {S::recalibrating, T::calibration_kept, S::stereo_odometry,
       "the calibration in use fits as well as a new one"},
      {S::recalibrating, T::pose_lost, S::lost, "no pose for three frames"},
      {S::lost, T::pose_found, S::stereo_odometry, "relocalised"},
      {S::lost, T::pose_found_suspect, S::recalibrating, "relocalised; the rig is still suspect"},
      {S::lost, T::pose_found_uncalibrated, S::initialising, "relocalised, without a calibration"},
  });
}();

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
