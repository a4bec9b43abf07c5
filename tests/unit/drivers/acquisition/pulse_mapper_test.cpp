
#include <gtest/gtest.h>

#include "drivers/acquisition/acquired_queue.hpp"
#include "drivers/acquisition/clock_record.hpp"
#include "drivers/sync/durations.hpp"

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);
const HostStamp kHost(70'000'000'000);

ClockMapperOptions exact() { return {.min_delay = Duration::milliseconds(1)}; }

TEST(CameraClock, growingExposureIsNoDrift) {
  CameraClock clock(exact());
  for (int n = 0; n < 100; ++n) {
    Frame frame;
    frame.exposure = Duration::milliseconds(2) + Duration::microseconds(100) * n;
    frame.exposure_start = DeviceStamp(0) + kInterval * n;
    // A fixed time after the exposure's end.
    frame.arrival = kHost + kInterval * n + frame.exposure + Duration::milliseconds(1) -
                    Duration::milliseconds(2);
    const MappedStamp start = clock.exposure_start(frame);
    EXPECT_LE(magnitude(start.host - (kHost + kInterval * n)),
              start.error + Duration::microseconds(1))
        << n;
  }
  EXPECT_EQ(clock.resets(), 0U);
}

TEST(PairingTracker, cameraWithoutFramesIsNotReported) {
  PairingTracker watch;
  EXPECT_FALSE(watch.update(0, false, kHost));
  watch.frame(0);
  EXPECT_FALSE(watch.update(1, false, kHost));
  const auto change = watch.update(0, false, kHost);
  ASSERT_TRUE(change);
  EXPECT_FALSE(change->verified);
}

}  // namespace
}  // namespace vergence
