
#include <gtest/gtest.h>

#include "drivers/acquisition/acquired_queue.hpp"
#include "drivers/acquisition/clock_record.hpp"
#include "drivers/sync/durations.hpp"

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);
const HostStamp kHost(70'000'000'000);

ClockMapperOptions exact() { return {.min_delay = Duration::milliseconds(1)}; }

TEST(PulseMapper, mappedPulseIsUnchanged) {
  PulseMapper mapper(exact());
  Pulse p{.arrival = kHost,
          .mapped = true,
          .host = HostStamp(1234),
          .host_error = Duration::nanoseconds(5)};
  const PulseMapper::Report report = mapper.add(p);
  EXPECT_EQ(report.pulse.host, HostStamp(1234));
  EXPECT_EQ(report.pulse.host_error, Duration::nanoseconds(5));
}

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
