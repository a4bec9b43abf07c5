#include "drivers/mock/simulators/simulated_line.hpp"

#include <gtest/gtest.h>

namespace vergence::mock {
namespace {

using Transfers = std::vector<std::vector<std::uint8_t>>;

constexpr Duration kTimer = Duration::milliseconds(16);
const HostStamp kStart(1'000'000'000), kFrame(1'000'400'000);

struct Converter : ::testing::Test {
  /// Lets the timer and the frames happen, in their order, up to a time.
  void run(HostStamp until) {
    for (;;) {
      const auto timer = converter.timer_at();
      const bool timer_first = timer && *timer <= converter.frame_at();
      const HostStamp at = timer_first ? *timer : converter.frame_at();
      if (at > until) return;
      if (timer_first)
        converter.run_out();
      else
        converter.frame(at, &transfers);
    }
  }
  void receive(int bytes) {
    for (int i = 0; i < bytes; ++i) converter.receive(static_cast<std::uint8_t>(i));
  }
  UsbConverter converter{kTimer, 0, kStart, kFrame};
  Transfers transfers;
};

TEST_F(Converter, aFewBytesGoWithTheFrameAfterTheTimerHasRunOut) {
  receive(10);
  run(kStart + kTimer);
  EXPECT_TRUE(transfers.empty());
  receive(3);  // too late for that packet
  run(kStart + kTimer + Duration::milliseconds(1));
  ASSERT_EQ(transfers.size(), 1U);
  EXPECT_EQ(transfers[0].size(), 10U);
  EXPECT_FALSE(converter.empty());
  run(kStart + kTimer * 2 + Duration::milliseconds(2));
  ASSERT_EQ(transfers.size(), 2U);
  EXPECT_EQ(transfers[1].size(), 3U);
  EXPECT_TRUE(converter.empty());
}

TEST_F(Converter, aShortPacketCompletesATransferOfFullOnes) {
  receive(62 * 2 + 5);
  run(kStart + kTimer * 2);
  ASSERT_EQ(transfers.size(), 1U);
  EXPECT_EQ(transfers[0].size(), 129U);
}

TEST_F(Converter, whatIsDiscardedNeverComes) {
  receive(100);
  run(kStart + Duration::milliseconds(1));
  converter.discard();
  EXPECT_TRUE(converter.empty());
  run(kStart + Duration::seconds(1));
  EXPECT_TRUE(transfers.empty());
}

TEST(UsbConverterClock, aFastConverterClockIsALongerTimer) {
  const UsbConverter converter(kTimer, 1000, kStart, kFrame);
  EXPECT_EQ(converter.timer_at(), kStart + Duration::microseconds(16'016));
}

}  // namespace
}  // namespace vergence::mock
