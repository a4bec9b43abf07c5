#include "drivers/sync/clock_mapper.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/math/random.hpp"

namespace vergence {
namespace {

/// A device with a clock of its own and a transport that is late by at least `least`.
struct Device {
  double drift = 0;         // device seconds gained a host second
  std::int64_t offset = 0;  // ns
  Duration least = Duration::milliseconds(5);
  double jitter_mean = 150e3;  // ns, exponential
  Random random{7};

  [[nodiscard]] DeviceStamp read(HostStamp t) const {
    return DeviceStamp(t.ns() + offset + std::llround(drift * static_cast<double>(t.ns())));
  }
  [[nodiscard]] HostStamp arrival(HostStamp t) {
    const double late = -jitter_mean * std::log(1.0 - random.uniform());
    return t + least + Duration::nanoseconds(std::llround(std::min(late, 1.9e6)));
  }
};

ClockMapperOptions options_of(const Device& d) {
  ClockMapperOptions o;
  o.least_delay = d.least;
  return o;
}

HostStamp at(double s) { return HostStamp(std::llround(s * 1e9)); }

// The process slept, and what its driver had queued comes at once: none is within the stall.
TEST(ClockMapper, aBacklogIsNoClockThatWasSetBack) {
  Device device;
  ClockMapper mapper(options_of(device));
  for (int i = 0; i < 2000; ++i) {
    const HostStamp truth = at(10 + i * 0.05);
    HostStamp arrival = device.arrival(truth);
    if (i >= 1000 && i < 1008) arrival = at(10 + 999 * 0.05 + 0.95);  // 0.9 to 0.55 s late
    const MappedStamp m = mapper.map(device.read(truth), arrival);
    ASSERT_LE(std::abs((m.host - truth).to_seconds()), m.error.to_seconds()) << i;
  }
  EXPECT_EQ(mapper.resets(), 0U);
}

TEST(ClockMapper, stampsOfARegularDeviceNeverGoBack) {
  Device device{80e-6, -5'000'000'000};
  ClockMapper mapper(options_of(device));
  HostStamp last = at(0);
  for (int i = 0; i < 5000; ++i) {
    const HostStamp truth = at(50 + i / 120.0);
    const MappedStamp m = mapper.map(device.read(truth), device.arrival(truth));
    EXPECT_GT(m.host, last) << i;
    last = m.host;
  }
}

}  // namespace
}  // namespace vergence
