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

TEST(ClockMapper, findsOffsetAndDriftWithinItsOwnBound) {
  for (const double drift : {-90e-6, -3e-6, 0.0, 41e-6, 150e-6}) {
    Device device{drift, 123'456'789'012'345};
    ClockMapper mapper(options_of(device));
    for (int i = 0; i < 20 * 200; ++i) {
      const HostStamp truth = at(1000 + i * 0.05);
      const MappedStamp m = mapper.map(device.read(truth), device.arrival(truth));
      const double error = std::abs((m.host - truth).to_seconds());
      ASSERT_LE(error, m.error.to_seconds()) << "drift " << drift << ", frame " << i;
      if (i == 20 * 100) {
        // Twenty delays a bin: the least of them is late by 150 µs / 20 = 7.5 µs on average; the
        // line lies under sixty of those.
        EXPECT_LT(error, 20e-6) << drift;
        EXPECT_NEAR(mapper.drift(), -drift / (1 + drift), 1e-6);
        EXPECT_LT(m.error.to_seconds(), 300e-6);
      }
    }
    EXPECT_EQ(mapper.resets(), 0U);
  }
}

TEST(ClockMapper, aClockThatIsSetForwardOrBackIsFoundAtOnceOrAfterAFewStamps) {
  for (const double jump : {3600.0, 0.3, -0.3, -3600.0}) {
    Device device;
    ClockMapper mapper(options_of(device));
    int wrong = 0;
    for (int i = 0; i < 600; ++i) {
      if (i == 300) device.offset += std::llround(jump * 1e9);
      const HostStamp truth = at(10 + i * 0.05);
      const MappedStamp m = mapper.map(device.read(truth), device.arrival(truth));
      const double error = std::abs((m.host - truth).to_seconds());
      if (error > m.error.to_seconds()) ++wrong;
    }
    EXPECT_EQ(mapper.resets(), 1U) << jump;
    // A clock set back by less than a stall looks like congestion until that has lasted for
    // kLagging stamps.
    EXPECT_LE(wrong, jump == -0.3 ? 16 : 0) << jump;
  }
}

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
