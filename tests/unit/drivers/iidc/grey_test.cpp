#include "drivers/iidc/camera_plan.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace vergence::iidc {
namespace {

std::vector<std::uint8_t> convert(const GreyConversion& c, const std::vector<std::uint8_t>& in,
                                  int width, int height, std::size_t stride) {
  std::vector<std::uint8_t> out(stride * static_cast<std::size_t>(height), 0xEE);
  to_grey(c, in.data(), width, height, out.data(), stride);
  return out;
}

TEST(Grey, sixteenBitsKeepTheHighestEffectiveBits) {
  const std::vector<std::uint8_t> be{0x12, 0x34, 0x0F, 0xFF, 0xFF, 0xFF, 0x00, 0x7F};
  EXPECT_EQ(convert({ColorCoding::mono16, false, 16}, be, 4, 1, 4),
            (std::vector<std::uint8_t>{0x12, 0x0F, 0xFF, 0x00}));
  EXPECT_EQ(convert({ColorCoding::mono16, false, 12}, be, 4, 1, 4),
            (std::vector<std::uint8_t>{0xFF, 0xFF, 0xFF, 0x07}));
}

TEST(Grey, lumaIsExtractedFromYuv) {
  const std::vector<std::uint8_t> uyvy{128, 1, 128, 2, 128, 3, 128, 4};
  EXPECT_EQ(convert({ColorCoding::yuv422, false, 16}, uyvy, 4, 1, 4),
            (std::vector<std::uint8_t>{1, 2, 3, 4}));
}

TEST(Grey, unsupportedFormatIsKnownBefore) {
  EXPECT_TRUE((GreyConversion{ColorCoding::mono8, false, 16}.none()));
  EXPECT_TRUE((GreyConversion{ColorCoding::raw8, false, 16}.none()));
  EXPECT_FALSE((GreyConversion{ColorCoding::raw8, true, 16}.none()));
  EXPECT_FALSE((GreyConversion{ColorCoding::raw16, true, 16}.possible()));
  EXPECT_FALSE((GreyConversion{ColorCoding::rgb8, false, 16}.possible()));
  EXPECT_FALSE((GreyConversion{ColorCoding::mono16, false, 4}.possible()));
}

}  // namespace
}  // namespace vergence::iidc
