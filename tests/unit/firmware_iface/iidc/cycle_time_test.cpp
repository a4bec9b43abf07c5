#include "firmware_iface/iidc/cycle_time.hpp"

#include <gtest/gtest.h>

namespace vergence::iidc {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(CycleTime, fieldsConvertToNanoseconds) {
  const CycleTime t = CycleTime::of(127U << 25U | 7999U << 12U | 3071U);
  EXPECT_EQ(t.seconds, 127U);
  EXPECT_EQ(t.cycle, 7999U);
  EXPECT_EQ(t.tick, 3071U);
  EXPECT_TRUE(t.valid());
  // One tick of 40.69 ns before the wrap.
  EXPECT_EQ(t.ns(), 128 * kSecond - 41);
  EXPECT_EQ((CycleTime{1, 1, 1536}.ns()), kSecond + 125'000 + 62'500);
  EXPECT_FALSE(CycleTime::of(8000U << 12U).valid());
  EXPECT_FALSE(CycleTime::of(3072U).valid());
}

TEST(CycleTime, roundTripStaysWithinOneTick) {
  for (std::int64_t ns = 0; ns < kCycleTimeWrapNs; ns += 777'777'777) {
    const CycleTime t = CycleTime::at(ns);
    ASSERT_TRUE(t.valid());
    EXPECT_LE(std::abs(t.ns() - ns), 41) << ns;
    EXPECT_EQ(CycleTime::of(t.quadlet()).ns(), t.ns());
  }
}

TEST(CycleUnwrapper, timeContinuesAcrossTheWrap) {
  CycleUnwrapper u;
  const std::int64_t host = 5'000 * kSecond;
  std::int64_t first = 0;
  // The loop covers 1000 s at 10 Hz.
  for (std::int64_t i = 0; i < 10'000; ++i) {
    const std::int64_t bus = 120 * kSecond + i * kSecond / 10;
    const std::int64_t t =
        u.unwrap(bus % kCycleTimeWrapNs, host + i * kSecond / 10 + i % 7 * 1'000'000);
    if (i == 0) first = t;
    ASSERT_EQ(t - first, i * kSecond / 10) << i;
  }
}

TEST(CycleUnwrapper, hostTimeResolvesWrapsOfLongPauses) {
  CycleUnwrapper u;
  const std::int64_t t0 = u.unwrap(100 * kSecond, 0);
  const std::int64_t pause = 10'000 * kSecond;
  // The bus clock ran 50 ppm fast meanwhile.
  const std::int64_t bus = pause + pause / 20'000;
  EXPECT_EQ(u.unwrap((100 * kSecond + bus) % kCycleTimeWrapNs, pause) - t0, bus);
}

TEST(CycleUnwrapper, sharedUnwrapperKeepsCamerasConsistent) {
  // The clocks are 64 s apart: alone, each camera's wrap would be a matter of luck.
  CycleUnwrapper u;
  const std::int64_t host = 1'000 * kSecond, bus = 127 * kSecond + 990'000'000;
  const std::int64_t a = u.unwrap(bus, host);
  // The second frame was exposed 20 ms later and arrived earlier.
  const std::int64_t b = u.unwrap((bus + 20'000'000) % kCycleTimeWrapNs, host + 5'000'000);
  EXPECT_EQ(b - a, 20'000'000);
  // An older stamp arrives late.
  EXPECT_EQ(u.unwrap(bus, host + 60'000'000), a);
}

TEST(CycleUnwrapper, restartForgetsCountedWraps) {
  CycleUnwrapper u;
  (void)u.unwrap(127 * kSecond, 0);
  EXPECT_EQ(u.unwrap(kSecond, 2 * kSecond), 129 * kSecond);
  u.restart();
  EXPECT_EQ(u.unwrap(kSecond, 3 * kSecond), kSecond);
}

}  // namespace
}  // namespace vergence::iidc
