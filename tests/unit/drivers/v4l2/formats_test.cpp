#include "drivers/v4l2/formats.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <vector>

#include "core/math/random.hpp"

namespace vergence::v4l2 {
namespace {

const PixelFormat& format(std::uint32_t fourcc) {
  const std::uint32_t offered[] = {fourcc};
  const PixelFormat* f = choose_format(offered, "");
  EXPECT_NE(f, nullptr) << name_of(fourcc);
  return *f;
}

TEST(V4l2Formats, cheapestFormatIsTheDefault) {
  const std::uint32_t offered[] = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_Y16,
                                   V4L2_PIX_FMT_GREY};
  EXPECT_EQ(choose_format(offered, "")->fourcc, V4L2_PIX_FMT_GREY);
  const std::uint32_t webcam[] = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV};
  EXPECT_EQ(choose_format(webcam, "")->fourcc, V4L2_PIX_FMT_YUYV);
  const std::uint32_t bridge[] = {V4L2_PIX_FMT_UYVY, V4L2_PIX_FMT_NV12};
  EXPECT_EQ(choose_format(bridge, "")->fourcc, V4L2_PIX_FMT_NV12) << "its luma plane needs no copy";
}

TEST(V4l2Formats, formatIsChosenByItsFourCharacters) {
  const std::uint32_t offered[] = {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y10, V4L2_PIX_FMT_YUYV};
  EXPECT_EQ(choose_format(offered, "YUYV")->fourcc, V4L2_PIX_FMT_YUYV);
  EXPECT_EQ(choose_format(offered, "Y10")->fourcc, V4L2_PIX_FMT_Y10)
      << "the trailing blank of its name is not typed";
  EXPECT_EQ(choose_format(offered, "UYVY"), nullptr) << "not offered";
  EXPECT_EQ(choose_format(offered, "MJPG"), nullptr);
  EXPECT_EQ(choose_format({}, ""), nullptr);
}

TEST(V4l2Formats, lastRowNeedsNoPadding) {
  const PixelFormat& grey = format(V4L2_PIX_FMT_GREY);
  EXPECT_EQ(min_frame_bytes(grey, 640, 480, 640), 640U * 480);
  EXPECT_EQ(min_frame_bytes(grey, 630, 480, 640), 640U * 479 + 630);
  EXPECT_EQ(min_frame_bytes(format(V4L2_PIX_FMT_YUYV), 640, 2, 1280), 2560U);
  EXPECT_EQ(min_row_bytes(format(V4L2_PIX_FMT_Y10P), 640), 800U);
  EXPECT_EQ(min_row_bytes(format(V4L2_PIX_FMT_Y10P), 641), 802U)
      << "a last group of one pixel has its low bits, too";
}

/// A format as the kernel's documentation lays it: bits of a sample, and where its first byte is.
struct Written {
  std::uint32_t fourcc, depth;
  std::size_t bytes_per_pixel = 2, offset = 0;
};

/// Random samples of a depth are written as such a format, and read back.
class V4l2Luma : public ::testing::TestWithParam<Written> {};

struct Laid {
  std::vector<std::uint8_t> bytes;
  // Expected grey values.
  std::vector<std::uint8_t> grey;
};

Laid lay(const Written& f, int width, int height, std::size_t stride, Random* random) {
  Laid laid;
  laid.bytes.assign(stride * static_cast<std::size_t>(height), 0xEE);
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = laid.bytes.data() + stride * static_cast<std::size_t>(y);
    for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
      const std::uint32_t sample = random->below(1U << f.depth);
      laid.grey.push_back(static_cast<std::uint8_t>(sample >> (f.depth - 8)));
      if (f.fourcc == V4L2_PIX_FMT_Y10P) {
        row[x / 4 * 5 + x % 4] = laid.grey.back();
        continue;
      }
      row[f.bytes_per_pixel * x + f.offset] = static_cast<std::uint8_t>(sample);
      if (f.depth > 8) row[2 * x + 1] = static_cast<std::uint8_t>(sample >> 8U);
    }
  }
  return laid;
}

TEST_P(V4l2Luma, equalsTheWrittenLuma) {
  Random random(GetParam().fourcc);
  const PixelFormat& f = format(GetParam().fourcc);
  for (const int width : {1, 3, 4, 7, 64, 97, 640}) {
    const int height = 5;
    const std::size_t stride = min_row_bytes(f, width) + random.below(9),
                      to_stride = static_cast<std::size_t>(width) + 3;
    const Laid laid = lay(GetParam(), width, height, stride, &random);
    std::vector<std::uint8_t> grey(to_stride * height, 0x55);
    to_grey(f, laid.bytes.data(), stride, width, height, grey.data(), to_stride);
    std::size_t i = 0;
    for (std::size_t y = 0; y < height; ++y) {
      for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x)
        ASSERT_EQ(grey[y * to_stride + x], laid.grey[i++])
            << name_of(f.fourcc) << " " << width << " at " << x << ", " << y;
      for (std::size_t x = static_cast<std::size_t>(width); x < to_stride; ++x)
        ASSERT_EQ(grey[y * to_stride + x], 0x55) << "past the row";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    , V4l2Luma,
    ::testing::Values(Written{V4L2_PIX_FMT_GREY, 8, 1}, Written{V4L2_PIX_FMT_NV12, 8, 1},
                      Written{V4L2_PIX_FMT_Y10P, 10}, Written{V4L2_PIX_FMT_Y10, 10},
                      Written{V4L2_PIX_FMT_Y12, 12}, Written{V4L2_PIX_FMT_Y14, 14},
                      Written{V4L2_PIX_FMT_Y16, 16}, Written{V4L2_PIX_FMT_YUYV, 8},
                      Written{V4L2_PIX_FMT_YVYU, 8}, Written{V4L2_PIX_FMT_UYVY, 8, 2, 1},
                      Written{V4L2_PIX_FMT_VYUY, 8, 2, 1}),
    [](const auto& p) { return name_of(p.param.fourcc); });

TEST(V4l2Formats, wordsBeyondTheirDepthSaturate) {
  // A ten-bit sensor stores its samples in the low bits of Y16.
  const PixelFormat shifted{V4L2_PIX_FMT_Y16, Layout::words, 2};
  const std::uint8_t words[] = {0xFF, 0x03, 0x00, 0x04, 0x08, 0x00};
  std::uint8_t grey[3] = {};
  to_grey(shifted, words, sizeof words, 3, 1, grey, 3);
  EXPECT_EQ(grey[0], 255);
  EXPECT_EQ(grey[1], 255) << "1024 of 1023";
  EXPECT_EQ(grey[2], 2);
}

}  // namespace
}  // namespace vergence::v4l2
