#include "firmware_iface/iidc/features.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "firmware_iface/iidc/frame_info.hpp"

namespace vergence::iidc {
namespace {

TEST(Features, registerOffsetsAreThoseOfIidc131) {
  EXPECT_EQ(reg::feature_value(Feature::shutter), 0x81CU);
  EXPECT_EQ(reg::feature_value(Feature::gain), 0x820U);
  EXPECT_EQ(reg::feature_value(Feature::frame_rate), 0x83CU);
  EXPECT_EQ(reg::feature_inquiry(Feature::gain), 0x520U);
  EXPECT_EQ(reg::feature_absolute_base(Feature::gain), 0x720U);
  EXPECT_EQ(reg::rate_inquiry(2, 2), 0x248U);
  EXPECT_EQ(reg::mode_inquiry(7), 0x19CU);
}

TEST(Features, inquiryBitsAreDecoded) {
  const FeatureInquiry q = FeatureInquiry::of(0xC600'0000);
  EXPECT_TRUE(q.present && q.absolute && q.on_off && q.automatic);
  EXPECT_FALSE(FeatureInquiry::of(0x4000'0000).on_off);
  EXPECT_FALSE(FeatureInquiry::of(0).present);
}

TEST(Features, valueQuadletRoundTrips) {
  FeatureValue v{.present = true, .absolute = true, .on = true, .value = 0x123};
  EXPECT_EQ(v.quadlet(), 0xC200'0123U);
  for (const std::uint32_t q : {0xC200'0123U, 0x8100'0FFFU, 0x8700'0000U})
    EXPECT_EQ(FeatureValue::of(q).quadlet(), q);
}

TEST(Features, triggerInquiryAndModeUseTheirBits) {
  // Present, readable, switchable, polarity, level, sources 0 and 1, software, modes 0, 14, 15.
  const TriggerInquiry t = TriggerInquiry::of(bit(31) | bit(27) | bit(26) | bit(25) | bit(24) |
                                              bit(23) | bit(22) | bit(16) | bit(15) | 3);
  EXPECT_TRUE(t.present && t.polarity && t.software);
  EXPECT_TRUE(t.has_mode(0) && t.has_mode(14) && t.has_mode(15));
  EXPECT_FALSE(t.has_mode(1) || t.has_mode(13) || t.has_mode(99));
  EXPECT_TRUE(t.has_source(0) && t.has_source(1) && t.has_source(kTriggerSourceSoftware));
  EXPECT_FALSE(t.has_source(2) || t.has_source(4));

  TriggerMode m{.on = true, .source = 1, .mode = 14};
  EXPECT_EQ(m.quadlet(), 0x832E'0000U);
  m.rising = false;
  m.source = kTriggerSourceSoftware;
  m.mode = 0;
  EXPECT_EQ(m.quadlet(), 0x82E0'0000U);
}

TEST(Features, strobeTimesAreCutToTwelveBits) {
  StrobeControl s{.on = true, .delay = 0x1ABC, .duration = 0x1DEF};
  EXPECT_EQ(s.quadlet(), 0x83AB'CDEFU);
}

TEST(Features, isoChannelRoundTripsInBothLayouts) {
  EXPECT_EQ((IsoChannel{5, 2, false}.quadlet()), 0x5200'0000U);
  EXPECT_EQ((IsoChannel{33, 3, true}.quadlet()), 0x0000'A103U);
  const IsoChannel b = IsoChannel::of(0x0000'A103);
  EXPECT_TRUE(b.beta);
  EXPECT_EQ(b.channel, 33U);
  EXPECT_EQ(b.speed, 3U);
  EXPECT_EQ(IsoChannel::of(0x5200'0000).channel, 5U);
}

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
