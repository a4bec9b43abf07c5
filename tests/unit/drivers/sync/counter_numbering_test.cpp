#include "drivers/sync/counter_numbering.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);

HostStamp at(std::int64_t pulse) { return HostStamp(1'000'000'000) + kInterval * pulse; }

TEST(CounterNumbering, frameBeforeTheFirstPulseGetsItsNumber) {
  CounterNumbering numbering(kInterval, false);
  numbering.record(1, at(10), true);
  numbering.align(1);
  EXPECT_EQ(numbering.number_of(1, 6, at(2)), 0U);
  EXPECT_FALSE(numbering.number_of_lost(1, 7));
}

TEST(CounterNumbering, counterJumpOfHoursIsIgnored) {
  CounterNumbering numbering(kInterval, false);
  numbering.record(20, at(20), true);
  EXPECT_EQ(numbering.number_of(0, 5'000'000'000, at(21)), 21U);
  EXPECT_EQ(numbering.number_of(0, 5'000'000'001, at(22)), 22U);
}

TEST(CounterNumbering, leaderTimesTakePrecedence) {
  CounterNumbering numbering(kInterval, false);
  numbering.record(5, at(5), false);
  numbering.record(6, at(6), true);
  numbering.record(7, at(17), false);
  numbering.align(1);
  EXPECT_EQ(numbering.number_of(1, 0, at(8)), 8U);
}

}  // namespace
}  // namespace vergence
