#include "app/session/timing_monitor.hpp"

#include <gtest/gtest.h>

#include <string>

namespace vergence::app {
namespace {

AcquiredReading reading(std::int64_t stamp_ns, std::int64_t utc_ns) {
  AcquiredReading r;
  r.sample.stamp = Stamp(stamp_ns);
  r.quality.utc_valid = true;
  r.quality.utc_ns = utc_ns;
  return r;
}

TEST(TimingMonitor, saysHowFarTheStampsAreFromUtcAndAgainOnceThatHasChanged) {
  TimingMonitor monitor(SyncMode::board, false);
  constexpr std::int64_t kUtc = 1'700'000'000'000'000'000, kMs = 1'000'000;
  (void)monitor.of_reading(reading(kUtc, kUtc));  // tells of the fix
  const auto told = monitor.of_reading(reading(kUtc - 250 * kMs, kUtc));
  ASSERT_NE(told.kind, nullptr);
  EXPECT_STREQ(told.kind, "utc");
  const std::string text = told.text.data();
  EXPECT_NE(text.find("the session's stamps are 0.2500 s behind the INS's UTC"), std::string::npos)
      << text << ": the host's clock may have been set since the start";
  EXPECT_EQ(monitor.of_reading(reading(kUtc - 200 * kMs, kUtc)).kind, nullptr);
  const auto set = monitor.of_reading(reading(kUtc + 3000 * kMs, kUtc));
  ASSERT_NE(set.kind, nullptr);
  EXPECT_NE(std::string(set.text.data()).find("3.0000 s ahead of"), std::string::npos);
}

}  // namespace
}  // namespace vergence::app
