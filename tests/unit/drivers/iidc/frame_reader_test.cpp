#include "drivers/iidc/frame_reader.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "core/math/random.hpp"

namespace vergence::iidc {
namespace {

CameraPlan plan() {
  return {.trigger = CameraTrigger::free,
          .rate_hz = 10,
          .exposure = Duration::milliseconds(2),
          .shape = {640 * 8, 640 * 8, 640, BusSpeed::s400, 4},
          .info = FrameInfoLayout::of(0x8000'0041)};
}

/// A picture of noise with number and stamp.
std::vector<std::uint8_t> image(std::uint32_t counter, std::int64_t camera_ns, Random* random) {
  std::vector<std::uint8_t> out(640 * 8);
  for (auto& b : out) b = static_cast<std::uint8_t>(random->below(256));
  const std::uint32_t stamp = CycleTime::at(camera_ns).quadlet();
  for (unsigned i = 0; i < 4; ++i) {
    out[i] = static_cast<std::uint8_t>(stamp >> (24 - 8 * i));
    out[4 + i] = static_cast<std::uint8_t>(counter >> (24 - 8 * i));
  }
  return out;
}

TEST(FrameReader, noiseIsNotTakenForTheNextFrame) {
  Random random(9);
  FrameReader reader;
  SharedClock clock;
  reader.begin(plan(), true, &clock);
  for (std::uint32_t n = 0; n < 20'000; ++n) {
    const auto pixels = image(n, 1'000'000'000 + n * std::int64_t{100'000'000}, &random);
    Arrival a{.data = pixels.data(),
              .bytes = pixels.size(),
              .at = HostStamp(n * std::int64_t{100'000'000})};
    const ReadFrame f = reader.read(a);
    ASSERT_TRUE(f.accepted);
    ASSERT_EQ(f.status, FrameStatus::complete) << n;
    ASSERT_EQ(f.counter, n);
  }
}

TEST(FrameReader, anyBytesGiveAResult) {
  Random random(10);
  SharedClock clock;
  for (const std::uint32_t items : {0U, 0x8000'0001U, 0x8000'0040U, 0x8000'0041U, 0x8000'03FFU}) {
    FrameReader reader;
    CameraPlan p = plan();
    p.info = FrameInfoLayout::of(items);
    reader.begin(p, true, &clock);
    std::uint64_t last = 0;
    bool any = false;
    for (int n = 0; n < 3000; ++n) {
      std::vector<std::uint8_t> bytes(random.below(3) == 0 ? random.below(60) : 640 * 8);
      for (auto& b : bytes)
        b = static_cast<std::uint8_t>(random.below(4) == 0 ? random.below(256) : 0);
      Arrival a{.data = bytes.data(),
                .bytes = bytes.size(),
                .at = HostStamp(n * std::int64_t{10'000'000})};
      const ReadFrame f = reader.read(a);
      if (!f.accepted) continue;
      ASSERT_TRUE(!any || f.counter > last);
      any = true;
      last = f.counter;
    }
  }
}

TEST(FrameReader, busStampsShowGapsWithoutEmbeddedData) {
  FrameReader reader;
  CameraPlan p = plan();
  p.info = {};
  reader.begin(p, true, nullptr);
  const std::vector<std::uint8_t> pixels(640 * 8);
  std::uint64_t missing = 0, last = 0;
  for (const int k : {0, 1, 2, 5, 6, 8}) {
    Arrival a{.data = pixels.data(),
              .bytes = pixels.size(),
              .has_bus_stamp = true,
              .bus_stamp = HostStamp(k * std::int64_t{100'000'000} + k % 2 * 125'000)};
    a.at = a.bus_stamp + Duration::milliseconds(80);
    const ReadFrame f = reader.read(a);
    missing += f.missing;
    last = f.counter;
  }
  EXPECT_EQ(missing, 3U);
  EXPECT_EQ(last, 8U);
}

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
