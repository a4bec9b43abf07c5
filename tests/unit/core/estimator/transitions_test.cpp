#include "core/estimator/transitions.hpp"

#include <gtest/gtest.h>

#include <array>

namespace vergence {
namespace {

TEST(Transitions, everyStateAnswersEveryTriggerAsTheMethodSays) {
  constexpr std::array kStates = {State::initialising,  State::parallel_monocular,
                                  State::calibrating,   State::stereo_odometry,
                                  State::recalibrating, State::lost};
  constexpr State kStays = static_cast<State>(255);
  // Rows: triggers in their order. Columns: states in theirs; where a state stays as it is, the
  // trigger means nothing there.
  using enum State;
  constexpr std::array<std::array<State, 6>, 12> kWanted = {{
      {stereo_odometry, kStays, kStays, kStays, kStays, kStays},           // calibration_given
      {parallel_monocular, kStays, kStays, kStays, kStays, kStays},        // pair_found
      {kStays, calibrating, kStays, kStays, kStays, kStays},               // frames_enough
      {kStays, kStays, stereo_odometry, kStays, stereo_odometry, kStays},  // calibration_accepted
      {kStays, kStays, parallel_monocular, kStays, kStays, kStays},        // calibration_rejected
      {kStays, kStays, kStays, kStays, stereo_odometry, kStays},           // calibration_saved
      {kStays, kStays, kStays, recalibrating, kStays, kStays},             // rig_changed
      {kStays, kStays, kStays, recalibrating, kStays, kStays},             // requested
      {kStays, lost, lost, lost, lost, kStays},                            // pose_lost
      {kStays, kStays, kStays, kStays, kStays, stereo_odometry},           // pose_found
      {kStays, kStays, kStays, kStays, kStays, recalibrating},             // pose_found_suspect
      {kStays, kStays, kStays, kStays, kStays, initialising},  // pose_found_uncalibrated
  }};
  ASSERT_EQ(static_cast<std::size_t>(Trigger::pose_found_uncalibrated) + 1, kWanted.size());
  for (std::size_t trigger = 0; trigger < kWanted.size(); ++trigger)
    for (std::size_t s = 0; s < kStates.size(); ++s) {
      const Transition* found = find_transition(kStates[s], static_cast<Trigger>(trigger));
      const State requested = kWanted[trigger][s];
      if (requested == kStays)
        EXPECT_EQ(found, nullptr) << to_string(kStates[s]) << ' ' << trigger;
      else if (found == nullptr)
        ADD_FAILURE() << to_string(kStates[s]) << " ignores trigger " << trigger;
      else
        EXPECT_EQ(found->to, requested) << to_string(kStates[s]) << ' ' << trigger;
    }
}

}  // namespace
}  // namespace vergence
