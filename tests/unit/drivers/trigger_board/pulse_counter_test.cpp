#include "drivers/trigger_board/pulse_counter.hpp"

#include <gtest/gtest.h>

namespace vergence::trigger_board {
namespace {

constexpr std::uint64_t kPeriod = 33'333;

TriggerEvent event(std::uint32_t number, std::uint64_t tick, std::uint8_t flags = 0) {
  TriggerEvent e{7, number, tick, 0, flags, {}};
  for (TriggerExposure& x : e.exposure) x = {TRIGGER_NOT_SEEN, TRIGGER_NOT_SEEN};
  return e;
}

/// An account of a board at 30 Hz that has just started, with pulse 0 taken.
struct Accounted : ::testing::Test {
  Accounted() {
    account.begin(7, 0);
    account.set_intervals(30'000, 0);
    EXPECT_TRUE(account.accept(event(0, kPeriod, 1), &pulse));
  }
  bool accept(std::uint32_t number, std::uint8_t flags = 0) {
    return account.accept(event(number, kPeriod * (number + 1ULL), flags), &pulse);
  }
  PulseCounter account;
  Pulse pulse{};
};

TEST_F(Accounted, pauseWithLostFirstReportIsRecognised) {
  account.expect_pause(4);
  ASSERT_TRUE(accept(1));
  ASSERT_TRUE(accept(7));
  EXPECT_TRUE(pulse.resumed);
  EXPECT_EQ(account.counters().lost, 1U);
}

TEST_F(Accounted, lossesBeforeAPauseAreCounted) {
  account.expect_pause(4);
  ASSERT_TRUE(accept(3));
  EXPECT_FALSE(pulse.resumed);
  EXPECT_EQ(account.counters().lost, 2U);
  ASSERT_TRUE(accept(8, 1));
  EXPECT_EQ(account.counters().lost, 2U);
}

TEST_F(Accounted, numbersSkippedByTheBoardAreNotLost) {
  ASSERT_TRUE(accept(4, 2));
  EXPECT_EQ(account.counters().lost, 0U);
}

TEST_F(Accounted, intervalsMayBeShorterByDitherAndRounding) {
  EXPECT_TRUE(account.accept(event(41, 39 * kPeriod), &pulse));
  account.set_intervals(30'000, 10'000);
  EXPECT_TRUE(account.accept(event(82, 65 * kPeriod), &pulse));
}

TEST_F(Accounted, missingReportsAreCountedAtTheEnd) {
  ASSERT_TRUE(accept(1));
  account.end(2, 0);
  EXPECT_EQ(account.counters().lost, 0U);
  account.end(6, 1);
  EXPECT_EQ(account.counters().lost, 3U);
  ASSERT_TRUE(accept(6, 1));
  EXPECT_EQ(account.counters().lost, 3U);
}

TEST_F(Accounted, repeatedAndOlderEventsAreRefused) {
  ASSERT_TRUE(accept(1));
  EXPECT_FALSE(accept(1));
  EXPECT_FALSE(accept(0));
  EXPECT_FALSE(account.accept(event(2, kPeriod), &pulse));
  EXPECT_FALSE(account.accept(event(2, 2 * kPeriod), &pulse)) << "at the tick of the one before";
  EXPECT_FALSE(account.accept(event(2, kMaxTicks + 1), &pulse));
  EXPECT_FALSE(account.accept(event(5, 3 * kPeriod), &pulse)) << "too many for the time";
  EXPECT_EQ(account.refused_in_row(), 6);
  EXPECT_EQ(pulse.number, 1U) << "untouched";
  EXPECT_TRUE(accept(2));
  EXPECT_EQ(account.refused_in_row(), 0);
  EXPECT_EQ(account.counters().lost, 0U);
}

TEST(PulseCounter, numbersContinueBeyond32Bits) {
  PulseCounter account;
  account.set_intervals(30'000, 0);
  account.begin(7, 0xFFFFFFFEU);
  Pulse pulse;
  const std::uint64_t years = 4'294'967'296ULL * kPeriod;
  ASSERT_TRUE(account.accept(event(0xFFFFFFFFU, years), &pulse));
  EXPECT_EQ(account.counters().lost, 1U) << "the board said what its next number is";
  ASSERT_TRUE(account.accept(event(0, years + kPeriod), &pulse));
  EXPECT_EQ(pulse.number, 0x100000000ULL);
  ASSERT_TRUE(account.accept(event(2, years + 3 * kPeriod), &pulse));
  EXPECT_EQ(pulse.number, 0x100000002ULL);
  EXPECT_EQ(account.counters().lost, 2U);
}

TEST_F(Accounted, impossibleExposuresAreRefusedAndCounted) {
  TriggerEvent e = event(1, 2 * kPeriod);
  e.exposure[0] = {120, 8120};
  e.exposure[1] = {-5, 100};
  e.exposure[2] = {100, 50};
  e.exposure[3] = {100, TRIGGER_NOT_SEEN};
  ASSERT_TRUE(account.accept(e, &pulse));
  EXPECT_TRUE(pulse.exposure[0].seen);
  EXPECT_EQ(pulse.exposure[0].start, Duration::microseconds(120));
  EXPECT_EQ(pulse.exposure[0].end, Duration::microseconds(8120));
  EXPECT_FALSE(pulse.exposure[1].seen || pulse.exposure[2].seen || pulse.exposure[3].seen);
  EXPECT_EQ(account.counters().exposures_refused, 2U);
  e = event(2, 3 * kPeriod);
  // An exposure lasts ten seconds at most.
  e.exposure[0] = {120, 10'000'001};
  ASSERT_TRUE(account.accept(e, &pulse));
  EXPECT_FALSE(pulse.exposure[0].seen);
  EXPECT_EQ(account.counters().exposures_refused, 3U);
}

}  // namespace
}  // namespace vergence::trigger_board
