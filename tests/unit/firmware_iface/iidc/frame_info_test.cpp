#include "firmware_iface/iidc/frame_info.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace vergence::iidc {
namespace {

TEST(FrameInfo, allItemsFollowInOrderWithoutGaps) {
  const FrameInfoLayout all = FrameInfoLayout::of(0x8000'03FF);
  EXPECT_EQ(all.size(), 40U);
  std::vector<std::uint8_t> image(64);
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<std::uint8_t>(i);
  EXPECT_EQ(all.read(FrameInfoItem::time, image), 0x0001'0203U);
  // The counter begins at byte 24.
  EXPECT_EQ(all.read(FrameInfoItem::counter, image), 0x1819'1A1BU);
  EXPECT_EQ(all.read(FrameInfoItem::region, image), 0x2425'2627U);
}

TEST(FrameInfo, timeAndCounterTakeEightBytes) {
  const FrameInfoLayout two = FrameInfoLayout::of(0x8000'0041);
  EXPECT_EQ(two.size(), 8U);
  EXPECT_TRUE(two.has(FrameInfoItem::time));
  EXPECT_TRUE(two.has(FrameInfoItem::counter));
  EXPECT_FALSE(two.has(FrameInfoItem::shutter));
  const std::vector<std::uint8_t> image{0, 0, 0, 1, 0x12, 0x34, 0x56, 0x78};
  EXPECT_EQ(two.read(FrameInfoItem::counter, image), 0x1234'5678U);
}

TEST(FrameInfo, absentFeatureOrItemsGiveNoLayout) {
  EXPECT_EQ(FrameInfoLayout::of(0).size(), 0U);
  EXPECT_EQ(FrameInfoLayout::of(0x41).size(), 0U);
  EXPECT_EQ(FrameInfoLayout::of(0x8000'0000).size(), 0U);
  // The register has the counter only.
  EXPECT_EQ(FrameInfoLayout::of(0x8000'0040).size(), 4U);
}

TEST(CounterUnwrapper, countsFromZeroAcrossTheWrap) {
  CounterUnwrapper c;
  EXPECT_EQ(c.unwrap(0xFFFF'FFFEU), 0U);
  EXPECT_EQ(c.step(0xFFFF'FFFFU), 1);
  EXPECT_EQ(c.unwrap(0xFFFF'FFFFU), 1U);
  EXPECT_EQ(c.step(2), 3);
  EXPECT_EQ(c.unwrap(2), 4U);
  EXPECT_EQ(c.step(1), -1);
  EXPECT_EQ(c.rebase(0), 5U);
  EXPECT_EQ(c.unwrap(1), 6U);
}

TEST(FrameInfo, everyRegisterValueGivesAFittingLayout) {
  const std::vector<std::uint8_t> image(40, 0xFF);
  for (std::uint32_t q = 0; q < 4096; ++q)
    for (const std::uint32_t present : {0U, kFrameInfoPresent}) {
      const FrameInfoLayout layout = FrameInfoLayout::of(q | present);
      ASSERT_LE(layout.size(), image.size());
      for (unsigned i = 0; i < kFrameInfoItems; ++i) {
        const auto item = static_cast<FrameInfoItem>(i);
        ASSERT_TRUE(!layout.has(item) || layout.read(item, image) == 0xFFFF'FFFFU);
      }
    }
}

}  // namespace
}  // namespace vergence::iidc
