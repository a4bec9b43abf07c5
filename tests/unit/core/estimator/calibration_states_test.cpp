#include "core/estimator/calibration_states.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

TEST(CalibrationStates, onlyDoubtLeadsToSuspectAndOnlyADriveToVerified) {
  using S = CalibrationState;
  using T = CalibrationTrigger;
  for (const CalibrationTransition& t : kCalibrationTransitions) {
    EXPECT_EQ(t.to == S::suspect, t.on == T::doubted);
    EXPECT_EQ(t.to == S::verified, t.on == T::confirmed || t.on == T::adopted_verified);
    EXPECT_NE(t.to, S::none);
    EXPECT_EQ(after(t.from, t.on), t.to) << "a row hides another";
  }
  EXPECT_EQ(after(S::none, T::doubted), S::none);
  EXPECT_EQ(after(S::suspect, T::confirmed), S::suspect);
}

}  // namespace
}  // namespace vergence
