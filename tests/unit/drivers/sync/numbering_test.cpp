#include "drivers/sync/counter_numbering.hpp"

#include <gtest/gtest.h>

#include "drivers/sync/time_numbering.hpp"

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

// One millisecond in ns.
constexpr std::int64_t kMs = 1'000'000;

SyncOptions options(SyncMode mode) {
  SyncOptions o{
      .interval = Duration::milliseconds(50), .mode = mode, .tolerance = Duration::milliseconds(2)};
  return o;
}

OpenSet& open(OpenSets* sets, std::uint64_t number, std::int64_t time) {
  OpenSet& set = sets->open(number, HostStamp(0));
  set.set.present[0] = true;
  set.images[0].time = time;
  return set;
}

TEST(TimeNumbering, busClockWrapIsUnwrapped) {
  const TimeNumbering numbering(options(SyncMode::ieee1394_cycle_time));
  OpenSets sets;
  SyncFrame frame{.exposure_start = DeviceStamp(127'990 * kMs),
                  .exposure = Duration::milliseconds(10)};
  EXPECT_EQ(numbering.time_of(frame, sets), 127'995 * kMs);
  open(&sets, 0, 127'995 * kMs);
  frame.exposure_start = DeviceStamp(40 * kMs);
  EXPECT_EQ(numbering.time_of(frame, sets), 128'045 * kMs);
  frame.exposure_start = DeviceStamp(4 * 128'000 * kMs + 127'890 * kMs);
  EXPECT_EQ(numbering.time_of(frame, sets), 127'895 * kMs) << "another camera's count of wraps";
}

}  // namespace
}  // namespace vergence
