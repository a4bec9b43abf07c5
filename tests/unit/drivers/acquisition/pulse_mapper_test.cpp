
#include <gtest/gtest.h>

#include "drivers/acquisition/acquired_queue.hpp"
#include "drivers/acquisition/clock_record.hpp"
#include "drivers/sync/durations.hpp"

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);
const HostStamp kHost(70'000'000'000);

ClockMapperOptions exact() {
  ClockMapperOptions o;
  o.least_delay = Duration::milliseconds(1);
  return o;
}

Pulse pulse(int n, std::uint32_t boot = 0) {
  Pulse p;
  p.number = static_cast<std::uint64_t>(n);
  p.edge = DeviceStamp(0) + kInterval * n;
  p.arrival = kHost + kInterval * n + Duration::milliseconds(1);
  p.boot = boot;
  return p;
}

TEST(PulseMapper, mapsAnEdgeByWhenItsReportArrived) {
  PulseMapper mapper(exact());
  for (int n = 0; n < 20; ++n) {
    const PulseMapper::Report report = mapper.add(pulse(n));
    EXPECT_TRUE(report.pulse.mapped);
    EXPECT_LE(magnitude(report.pulse.host - (kHost + kInterval * n)), report.pulse.host_error);
    EXPECT_FALSE(report.rebooted);
  }
}

TEST(PulseMapper, leavesWhatTheDriverHasMapped) {
  PulseMapper mapper(exact());
  Pulse p = pulse(3);
  p.mapped = true;
  p.host = HostStamp(1234);
  p.host_error = Duration::nanoseconds(5);
  const PulseMapper::Report report = mapper.add(p);
  EXPECT_EQ(report.pulse.host, HostStamp(1234));
  EXPECT_EQ(report.pulse.host_error, Duration::nanoseconds(5));
}

TEST(PulseMapper, anotherBootIsToldOnceAndIsAFitOfItsOwn) {
  PulseMapper mapper(exact());
  for (int n = 0; n < 20; ++n) (void)mapper.add(pulse(n));
  Pulse first = pulse(0, 1);  // the edges begin at zero again, the host's time goes on
  first.arrival = first.arrival + kInterval * 40;
  const PulseMapper::Report report = mapper.add(first);
  EXPECT_TRUE(report.rebooted);
  EXPECT_LE(magnitude(report.pulse.host - (kHost + kInterval * 40)), report.pulse.host_error);
  EXPECT_EQ(mapper.clock_resets(), 0U) << "told, not found";
  Pulse second = pulse(1, 1);
  second.arrival = second.arrival + kInterval * 40;
  EXPECT_FALSE(mapper.add(second).rebooted);
}

TEST(CameraClock, anExposureThatGrowsIsNoClockThatDrifts) {
  CameraClock clock(exact());
  for (int n = 0; n < 100; ++n) {
    Frame frame;
    frame.exposure = Duration::milliseconds(2) + Duration::microseconds(100) * n;
    frame.exposure_start = DeviceStamp(0) + kInterval * n;
    // A fixed time after the exposure's end.
    frame.arrival = kHost + kInterval * n + frame.exposure + Duration::milliseconds(1) -
                    Duration::milliseconds(2);
    const MappedStamp start = clock.start_of(frame);
    EXPECT_LE(magnitude(start.host - (kHost + kInterval * n)),
              start.error + Duration::microseconds(1))
        << n;
  }
  EXPECT_EQ(clock.resets(), 0U);
}

TEST(PairingWatch, tellsNothingOfCamerasThatGaveNoFrame) {
  PairingWatch watch;
  EXPECT_FALSE(watch.look(0, false, kHost));
  watch.frame(0);
  EXPECT_FALSE(watch.look(1, false, kHost));
  const auto change = watch.look(0, false, kHost);
  ASSERT_TRUE(change);
  EXPECT_FALSE(change->proven);
}

}  // namespace
}  // namespace vergence
