#include <gtest/gtest.h>

#include <concepts>
#include <vector>

#include "core/math/random.hpp"
#include "core/types/bayer.hpp"
#include "core/types/calibration.hpp"
#include "core/types/pose_sample.hpp"

namespace vergence {
namespace {

template <class A, class B>
concept Subtractable = requires(A a, B b) {
  a - b;
};
static_assert(Subtractable<Stamp, Stamp>);
static_assert(Subtractable<Stamp, Duration>);
static_assert(!Subtractable<Stamp, HostStamp>, "two clocks have no difference");
static_assert(!std::convertible_to<std::int64_t, Stamp>);
static_assert(!std::convertible_to<std::int64_t, Duration>);

TEST(Duration, secondsRoundToTheNearestNanosecond) {
  EXPECT_EQ(Duration::seconds(0.049999872).ns(), 49'999'872);
  EXPECT_EQ(Duration::seconds(-0.049999872).ns(), -49'999'872);
  EXPECT_EQ(Duration::seconds(1.6e-9).ns(), 2);
  EXPECT_EQ(Duration::seconds(-1.6e-9).ns(), -2);
  EXPECT_EQ(Duration::seconds(0).ns(), 0);
  EXPECT_DOUBLE_EQ(Duration::nanoseconds(1'500'000'000).to_seconds(), 1.5);
}

TEST(Intrinsics, equidistantIsDistortedWithoutCoefficients) {
  Intrinsics k;
  EXPECT_FALSE(k.has_distortion());
  k.distortion[4] = 1e-3;
  EXPECT_TRUE(k.has_distortion());
  k = {};
  k.kind = CameraModelKind::pinhole_equidistant;
  EXPECT_TRUE(k.has_distortion());
}

/// The definition, pixel by pixel.
int by_definition(const std::vector<std::uint8_t>& raw, int stride, int width, int height, int x,
                  int y) {
  const auto mirrored = [](int i, int n) { return i < 0 ? -i : i >= n ? 2 * (n - 1) - i : i; };
  constexpr std::array<int, 3> kWeights{1, 2, 1};
  int sum = 8;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i)
      sum +=
          kWeights[static_cast<std::size_t>(i + 1)] * kWeights[static_cast<std::size_t>(j + 1)] *
          raw[static_cast<std::size_t>(mirrored(y + j, height) * stride + mirrored(x + i, width))];
  return sum / 16;
}

TEST(Bayer, greyMatchesTheDefinitionAtEverySize) {
  Random random(3);
  struct Size {
    int width, height;
  };
  for (const auto& [width, height] :
       {Size{2, 2}, Size{3, 2}, Size{2, 5}, Size{17, 9}, Size{640, 4}, Size{1021, 3}, Size{1022, 3},
        Size{1023, 3}, Size{1024, 3}, Size{2044, 3}, Size{2045, 3}}) {
    const int in_stride = width + 3, out_stride = width + 5;
    std::vector<std::uint8_t> raw(static_cast<std::size_t>(in_stride * height));
    for (auto& v : raw) v = static_cast<std::uint8_t>(random.below(256));
    std::vector<std::uint8_t> out(static_cast<std::size_t>(out_stride * height), 77);
    bayer_to_grey(raw.data(), in_stride, width, height, out.data(), out_stride);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < out_stride; ++x)
        ASSERT_EQ(out[static_cast<std::size_t>(y * out_stride + x)],
                  x < width ? by_definition(raw, in_stride, width, height, x, y) : 77)
            << width << " x " << height << " at " << x << ", " << y;
  }
}

}  // namespace
}  // namespace vergence
