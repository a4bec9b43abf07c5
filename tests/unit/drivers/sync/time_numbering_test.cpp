#include "drivers/sync/time_numbering.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

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
