#include "drivers/sync/counter_numbering.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);

HostStamp at(std::int64_t pulse) { return HostStamp(1'000'000'000) + kInterval * pulse; }

TEST(CounterNumbering, aCounterIsTheNumberUntilTimeIsAsked) {
  CounterNumbering numbering(kInterval, false);
  EXPECT_EQ(numbering.number_of(0, 3, at(100)), 3U);
  EXPECT_EQ(numbering.number_of_lost(1, 9), 9U);
}

TEST(CounterNumbering, aCameraThatCountsFromZeroAgainJoinsTheNearestPulse) {
  CounterNumbering numbering(kInterval, false);
  numbering.note(20, at(20), true);
  numbering.align(1);
  EXPECT_FALSE(numbering.number_of_lost(1, 0)) << "not known before its first frame";
  EXPECT_EQ(numbering.number_of(1, 0, at(23) + Duration::milliseconds(20)), 23U);
  EXPECT_FALSE(numbering.aligning(1));
  EXPECT_EQ(numbering.number_of(1, 4, at(90)), 27U) << "the others follow by the counter";
  EXPECT_EQ(numbering.number_of_lost(1, 5), 28U);
}

TEST(CounterNumbering, aFrameFromBeforeTheFirstPulseHasTheFirstNumber) {
  CounterNumbering numbering(kInterval, false);
  numbering.note(1, at(10), true);
  numbering.align(1);
  EXPECT_EQ(numbering.number_of(1, 6, at(2)), 0U);
  EXPECT_FALSE(numbering.number_of_lost(1, 7));
}

TEST(CounterNumbering, aCounterThatLeapsByHoursIsNotBelieved) {
  CounterNumbering numbering(kInterval, false);
  numbering.note(20, at(20), true);
  EXPECT_EQ(numbering.number_of(0, 5'000'000'000, at(21)), 21U);
  EXPECT_EQ(numbering.number_of(0, 5'000'000'001, at(22)), 22U);
}

TEST(CounterNumbering, timesAreThoseOfTheLeaderOnceItHasAny) {
  CounterNumbering numbering(kInterval, false);
  numbering.note(5, at(5), false);
  numbering.note(6, at(6), true);
  numbering.note(7, at(17), false);
  numbering.align(1);
  EXPECT_EQ(numbering.number_of(1, 0, at(8)), 8U);
}

TEST(CounterNumbering, stampsThatDisagreeOftenInARowAlignAllButTheFirstCamera) {
  CounterNumbering numbering(kInterval, true);
  for (std::size_t k = 0; k < kMaxCameras; ++k) (void)numbering.number_of(k, 0, at(0));
  for (int i = 1; i < CounterNumbering::kUnproven; ++i) EXPECT_FALSE(numbering.judge(false));
  EXPECT_FALSE(numbering.judge(true)) << "one that agrees ends the row";
  for (int i = 1; i < CounterNumbering::kUnproven; ++i) EXPECT_FALSE(numbering.judge(false));
  EXPECT_TRUE(numbering.judge(false));
  EXPECT_FALSE(numbering.aligning(0));
  for (std::size_t k = 1; k < kMaxCameras; ++k) EXPECT_TRUE(numbering.aligning(k));
}

TEST(CounterNumbering, countersThatNeedNoTimeAtTheStartNeedNoneLater) {
  CounterNumbering numbering(kInterval, false);
  for (int i = 0; i < 3 * CounterNumbering::kUnproven; ++i) EXPECT_FALSE(numbering.judge(false));
}

}  // namespace
}  // namespace vergence
