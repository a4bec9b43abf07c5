#include "drivers/clock.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace vergence {
namespace {

TEST(Clock, tightestTrialGivesTheMoment) {
  // The day's clock is 1000 s ahead. Every look takes a microsecond; the first trial is held up for
  // 7 ms after the day's clock was read, the second before.
  HostStamp now(5'000'000'000);
  int trial = 0;
  const auto host = [&now] { return now = now + Duration::microseconds(1); };
  const auto day = [&] {
    ++trial;
    if (trial == 2) now = now + Duration::milliseconds(7);
    const Stamp told(now.ns() + 1'000'000'000'000);
    if (trial == 1) now = now + Duration::milliseconds(7);
    return told;
  };
  const HostMoment moment = tightest_moment(day, host);
  EXPECT_LE(std::abs(moment.day.ns() - moment.host.ns() - 1'000'000'000'000), 1000);
  EXPECT_GT(trial, 2);
}

}  // namespace
}  // namespace vergence
