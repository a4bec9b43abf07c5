#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/types/pose_sample.hpp"

/// State machines of the estimator and of the calibration in use.
namespace vergence {

/// One edge of a state machine. `why` is written to events.jsonl unchanged.
template <class S, class T>
struct Edge {
  S from;
  T on;
  S to;
  const char* why = "";
};

/// Returns the edge of this trigger in this state, or nullptr if the trigger has no effect.
template <class S, class T, std::size_t N>
[[nodiscard]] constexpr const Edge<S, T>* find_edge(const std::array<Edge<S, T>, N>& edges, S state,
                                                    T trigger) noexcept {
  for (const Edge<S, T>& edge : edges)
    if (edge.from == state && edge.on == trigger) return &edge;
  return nullptr;
}

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

/// All edges of the estimator's state machine.
inline constexpr auto kTransitions = [] {
  using S = State;
  using T = Trigger;
  return std::to_array<Edge<S, T>>({
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

/// All edges of the calibration's state machine.
inline constexpr auto kCalibrationTransitions = [] {
  using S = CalibrationState;
  using T = CalibrationTrigger;
  return std::to_array<Edge<S, T>>({
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

}  // namespace vergence
