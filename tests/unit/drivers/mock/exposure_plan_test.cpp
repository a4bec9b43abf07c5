#include "drivers/mock/detail/devices.hpp"

#include <gtest/gtest.h>

namespace vergence::mock {
namespace {

ExposureSetting ms(int exposure) { return {Duration::milliseconds(exposure), 0}; }

TEST(ExposurePlan, aSettingHoldsFromItsPulseOn) {
  ExposurePlan plan;
  plan.reset(ms(8));
  plan.change(10, ms(4), 0);
  plan.change(20, ms(2), 0);
  EXPECT_EQ(plan.at(0).exposure, ms(8).exposure);
  EXPECT_EQ(plan.at(9).exposure, ms(8).exposure);
  EXPECT_EQ(plan.at(10).exposure, ms(4).exposure);
  EXPECT_EQ(plan.at(19).exposure, ms(4).exposure);
  EXPECT_EQ(plan.at(1000).exposure, ms(2).exposure);
}

TEST(ExposurePlan, aChangeReplacesThoseThatWereToHoldLater) {
  ExposurePlan plan;
  plan.reset(ms(8));
  plan.change(10, ms(4), 0);
  plan.change(20, ms(2), 0);
  plan.change(10, ms(6), 0);
  EXPECT_EQ(plan.at(9).exposure, ms(8).exposure);
  EXPECT_EQ(plan.at(10).exposure, ms(6).exposure);
  EXPECT_EQ(plan.at(25).exposure, ms(6).exposure);
}

TEST(ExposurePlan, whatOnlyPastPulsesHadIsForgottenAndTheRestIsNot) {
  ExposurePlan plan;
  plan.reset(ms(8));
  plan.change(10, ms(4), 0);
  plan.change(20, ms(2), 0);
  plan.change(40, ms(1), 15);
  EXPECT_EQ(plan.at(15).exposure, ms(4).exposure);
  EXPECT_EQ(plan.at(39).exposure, ms(2).exposure);
  EXPECT_EQ(plan.at(40).exposure, ms(1).exposure);
  plan.reset(ms(5));
  EXPECT_EQ(plan.at(40).exposure, ms(5).exposure);
}

}  // namespace
}  // namespace vergence::mock
