#include "drivers/sync/time_numbering.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

constexpr std::int64_t kMs = 1'000'000;  // ns

SyncOptions options(SyncMode mode) {
  SyncOptions o;
  o.mode = mode;
  o.interval = Duration::milliseconds(50);
  o.tolerance = Duration::milliseconds(2);
  return o;
}

OpenSet& open(OpenSets* sets, std::uint64_t number, std::int64_t time) {
  OpenSet& set = sets->open(number, HostStamp(0));
  set.set.present[0] = true;
  set.images[0].time = time;
  return set;
}

TEST(TimeNumbering, whatIsWithinTheToleranceOfAnOpenSetIsOfIt) {
  TimeNumbering numbering(options(SyncMode::ptp));
  OpenSets sets;
  EXPECT_EQ(numbering.number_of(0, 1000 * kMs, &sets).number, 0U);
  open(&sets, 0, 1000 * kMs);
  EXPECT_EQ(numbering.number_of(0, 1002 * kMs, &sets).number, 0U);
  EXPECT_EQ(numbering.number_of(0, 1003 * kMs, &sets).number, 1U) << "the next at least";
  EXPECT_EQ(numbering.number_of(0, 1148 * kMs, &sets).number, 3U);
}

TEST(TimeNumbering, whatFallsBesideSetsThatWentOutIsTooLate) {
  TimeNumbering numbering(options(SyncMode::ptp));
  OpenSets sets;
  sets.close(&open(&sets, 4, 1000 * kMs));
  EXPECT_EQ(numbering.number_of(0, 1001 * kMs, &sets).number, 4U);
  EXPECT_EQ(numbering.number_of(0, 950 * kMs, &sets).number, 4U);
  EXPECT_EQ(numbering.number_of(0, 1050 * kMs, &sets).number, 5U);
}

TEST(TimeNumbering, aFrameOfAMissingSetBeforeTheOpenOneGetsTheNumberBetween) {
  TimeNumbering numbering(options(SyncMode::ptp));
  OpenSets sets;
  sets.close(&open(&sets, 4, 1000 * kMs));
  open(&sets, 7, 1150 * kMs);
  EXPECT_EQ(numbering.number_of(0, 1100 * kMs, &sets).number, 6U);
}

TEST(TimeNumbering, theBusClockWrapsAfter128Seconds) {
  const TimeNumbering numbering(options(SyncMode::bus));
  OpenSets sets;
  SyncFrame frame;
  frame.exposure = Duration::milliseconds(10);
  frame.exposure_start = DeviceStamp(127'990 * kMs);
  EXPECT_EQ(numbering.time_of(frame, sets), 127'995 * kMs);
  open(&sets, 0, 127'995 * kMs);
  frame.exposure_start = DeviceStamp(40 * kMs);
  EXPECT_EQ(numbering.time_of(frame, sets), 128'045 * kMs);
  frame.exposure_start = DeviceStamp(4 * 128'000 * kMs + 127'890 * kMs);
  EXPECT_EQ(numbering.time_of(frame, sets), 127'895 * kMs) << "another camera's count of wraps";
}

TEST(TimeNumbering, whatIsBeforeTheFirstSetOrBetweenOpenOnesIsOfNone) {
  TimeNumbering numbering(options(SyncMode::ptp));
  OpenSets sets;
  open(&sets, 0, 1000 * kMs);
  EXPECT_FALSE(numbering.number_of(1, 980 * kMs, &sets).number);
  open(&sets, 1, 1050 * kMs);
  EXPECT_FALSE(numbering.number_of(1, 1020 * kMs, &sets).number);
  sets.close(sets.oldest());
  EXPECT_EQ(numbering.number_of(1, 1020 * kMs, &sets).number, 0U) << "has gone out";
}

/// From 60 s to the time that is given, one frame of each camera 50 ms after the other.
void expect_a_new_count_after_three_frames(std::int64_t from) {
  TimeNumbering numbering(options(SyncMode::ptp));
  OpenSets sets;
  sets.close(&open(&sets, 4, 60'000 * kMs));
  open(&sets, 5, 60'050 * kMs);
  for (std::size_t frame = 0; frame < 2; ++frame) {
    const std::int64_t time = from + static_cast<std::int64_t>(frame) * 50 * kMs;
    const TimeNumbering::Number n = numbering.number_of(frame % 2, time, &sets);
    EXPECT_FALSE(n.clock_set);
    EXPECT_FALSE(n.number);
  }
  const TimeNumbering::Number n = numbering.number_of(0, from + 100 * kMs, &sets);
  EXPECT_TRUE(n.clock_set);
  EXPECT_EQ(n.number, 6U);
  EXPECT_EQ(sets.flushed_below(), 6U) << "set 5 waits for nobody";
  open(&sets, 6, from + 100 * kMs);
  for (int frame = 0; frame < 5; ++frame)
    EXPECT_EQ(numbering.number_of(1, from + 150 * kMs, &sets).number, 7U)
        << "what was before the count is no measure";
}

TEST(TimeNumbering, aClockThatWasSetBeginsANewCountAfterThreeFrames) {
  expect_a_new_count_after_three_frames(1000 * kMs);
  expect_a_new_count_after_three_frames(1'700'000'000'000 * kMs);
}

TEST(TimeNumbering, theClockOfOneCameraIsApartWhileTheOthersFramesFit) {
  TimeNumbering numbering(options(SyncMode::ptp));
  OpenSets sets;
  sets.close(&open(&sets, 4, 60'000 * kMs));
  for (int frame = 0; frame < 4; ++frame) {
    EXPECT_EQ(numbering.apart(1), frame > 2);
    EXPECT_FALSE(numbering.number_of(1, 1'700'000'000'000 * kMs, &sets).number);
    EXPECT_EQ(numbering.number_of(0, 60'050 * kMs, &sets).number, 5U);
  }
  EXPECT_FALSE(numbering.apart(0));
  EXPECT_EQ(numbering.number_of(1, 60'050 * kMs, &sets).number, 5U);
  EXPECT_FALSE(numbering.apart(1));
}

}  // namespace
}  // namespace vergence
