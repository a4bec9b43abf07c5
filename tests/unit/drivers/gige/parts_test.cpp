#include <gtest/gtest.h>

#include "drivers/gige/detail/frame_receiver.hpp"
#include "drivers/gige/detail/grey.hpp"
#include "drivers/gige/detail/link.hpp"

namespace vergence::gige {
namespace {

TEST(GigeBlocks, sixteenBitIdsSkipZeroAtTheWrap) {
  BlockCounter blocks;
  std::uint64_t id = 65'533, expected = 0;
  for (int i = 0; i < 200'000; ++i, ++expected, id = id == 65'535 ? 1 : id + 1) {
    const auto step = blocks.next(id);
    ASSERT_TRUE(step) << id;
    ASSERT_EQ(step->counter, expected);
    ASSERT_EQ(step->missing, 0U);
  }
}

TEST(GigeBlocks, extendedIdsDoNotWrap) {
  BlockCounter blocks;
  EXPECT_EQ(blocks.next(65'534)->counter, 0U);
  EXPECT_EQ(blocks.next(65'535)->counter, 1U);
  EXPECT_EQ(blocks.next(65'536)->counter, 2U);
  EXPECT_EQ(blocks.next(65'540)->missing, 3U);
  EXPECT_EQ(blocks.next(0x1'0000'0000U)->counter, 0x1'0000'0000U - 65'534);
}

TEST(GigeBlocks, lateRepeatedAndZeroIdsAreRefused) {
  BlockCounter blocks;
  EXPECT_FALSE(blocks.next(0));
  EXPECT_TRUE(blocks.next(10));
  EXPECT_TRUE(blocks.next(12));
  EXPECT_FALSE(blocks.next(11));
  EXPECT_FALSE(blocks.next(12));
  EXPECT_FALSE(blocks.next(0));
  EXPECT_FALSE(blocks.next(65'535)) << "just before 1: old, not 65523 ahead";
  EXPECT_EQ(blocks.next(13)->counter, 3U);
}

constexpr std::int64_t kGigabit = 1'000'000'000;
constexpr Duration kComputed = Duration::nanoseconds(-1);

TEST(GigeLink, delayLeavesRoomForTheOtherCameras) {
  const LinkLoad two{1280 * 960, 30, 2, false};
  // (2 − 1) · (1500 + 38) · 8 / 10⁹ = 12.304 µs, and 10 % more.
  EXPECT_NEAR(plan_link(two, 1500, kGigabit, kComputed).delay.to_seconds(), 13.53e-6, 1e-8);
  EXPECT_NEAR(plan_link(two, 9000, kGigabit, kComputed).delay.to_seconds(), 79.53e-6, 1e-8);
  EXPECT_EQ(plan_link({1280 * 960, 30, 1, false}, 1500, kGigabit, kComputed).delay, Duration{})
      << "alone on its link";
  EXPECT_EQ(plan_link(two, 1500, 0, kComputed).delay, Duration{}) << "the loopback has no speed";
  EXPECT_EQ(plan_link(two, 1500, kGigabit, Duration::microseconds(5)).delay,
            Duration::microseconds(5));
}

TEST(GigeLink, packetsFitInterfaceCameraAndStep) {
  EXPECT_EQ(choose_packet_size(0, 1500, 576, 16'000, 4), 1500);
  EXPECT_EQ(choose_packet_size(0, 65'536, 576, 16'000, 4), 9000) << "what switches carry";
  EXPECT_EQ(choose_packet_size(0, 9000, 576, 8192, 4), 8192);
  EXPECT_EQ(choose_packet_size(0, 1501, 577, 9000, 4), 1501);
  EXPECT_EQ(choose_packet_size(0, 1503, 577, 9000, 4), 1501);
  EXPECT_EQ(choose_packet_size(16'000, 65'536, 576, 16'000, 4), 16'000);
  EXPECT_EQ(choose_packet_size(9000, 1500, 576, 16'000, 4), 1500) << "never fragmented";
}

TEST(GigeGrey, cheapestFormatIsChosen) {
  EXPECT_STREQ(choose_format({"Mono16", "BayerRG8", "Mono8"}, "")->name, "Mono8");
  EXPECT_STREQ(choose_format({"RGB8", "Mono16", "BayerRG8"}, "")->name, "BayerRG8");
  EXPECT_STREQ(choose_format({"Mono16", "Mono8"}, "Mono16")->name, "Mono16");
  EXPECT_EQ(choose_format({"Mono16", "Mono8"}, "Mono12"), nullptr);
  EXPECT_EQ(choose_format({"RGB8"}, ""), nullptr);
}

TEST(GigeGrey, wordsKeepTheirHighestEightBits) {
  // The words are 4095, 16, 2048 and 2799.
  const std::vector<std::uint8_t> words{0xFF, 0x0F, 0x10, 0x00, 0x00, 0x08, 0xEF, 0x0A};
  std::vector<std::uint8_t> out(2 * 64, 7);
  to_grey(*choose_format({"Mono12"}, ""), words.data(), 2, 2, out.data(), 64);
  EXPECT_EQ(out[0], 255);
  EXPECT_EQ(out[1], 1);
  EXPECT_EQ(out[64], 128);
  EXPECT_EQ(out[65], 174);
  EXPECT_EQ(out[2], 7) << "padding is not touched";
}

}  // namespace
}  // namespace vergence::gige
