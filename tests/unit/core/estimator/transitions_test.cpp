#include "core/estimator/transitions.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string_view>

namespace vergence {
namespace {

TEST(Transitions, everyStateMentionedIsReachedFromTheStart) {
  std::set<State> reached{State::initialising};
  for (std::size_t round = 0; round < kTransitions.size(); ++round)
    for (const Transition& t : kTransitions)
      if (reached.count(t.from) != 0) reached.insert(t.to);
  for (const Transition& t : kTransitions) {
    EXPECT_EQ(reached.count(t.from), 1U) << to_string(t.from);
    EXPECT_EQ(reached.count(t.to), 1U) << to_string(t.to);
  }
}

TEST(Transitions, noStateIsADeadEnd) {
  for (const Transition& t : kTransitions) {
    bool leaves = false;
    for (const Transition& u : kTransitions) leaves = leaves || (u.from == t.to && u.to != t.to);
    EXPECT_TRUE(leaves) << to_string(t.to);
  }
}

TEST(Transitions, everyStateButInitialisingLeavesToLost) {
  for (const Transition& t : kTransitions) {
    for (const State s : {t.from, t.to}) {
      if (s == State::initialising || s == State::lost) continue;
      const Transition* found = find_transition(s, Trigger::pose_lost);
      ASSERT_NE(found, nullptr) << to_string(s);
      EXPECT_EQ(found->to, State::lost);
    }
  }
  EXPECT_EQ(find_transition(State::initialising, Trigger::pose_lost), nullptr);
}

TEST(Transitions, whatMeansNothingInAStateDoesNothing) {
  EXPECT_EQ(find_transition(State::stereo_odometry, Trigger::pose_found), nullptr);
  EXPECT_EQ(find_transition(State::lost, Trigger::pose_lost), nullptr);
  EXPECT_EQ(find_transition(State::stereo_odometry, Trigger::calibration_given), nullptr);
}

TEST(Transitions, everyOneHasItsReason) {
  for (const Transition& t : kTransitions) EXPECT_FALSE(std::string_view(t.why).empty());
}

}  // namespace
}  // namespace vergence
