#include "drivers/mock/world/detail/texture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace vergence::mock {
namespace {

double mean(const Canvas& c) {
  double sum = 0;
  for (const float t : c.texels()) sum += static_cast<double>(t);
  return sum / static_cast<double>(c.texels().size());
}

int byte(std::int32_t word, int which) { return (word >> (8 * which)) & 255; }

TEST(Canvas, rectangleCoversExactlyItsArea) {
  Canvas c(6, 5, 6.4, 3.2, 0.0F);
  c.rectangle(1.03, 0.57, 2.61, 1.99, 1.0F);
  EXPECT_NEAR(mean(c) * 6.4 * 3.2, (2.61 - 1.03) * (1.99 - 0.57), 1e-4);
}

TEST(Canvas, drawingWrapsAroundTheEdges) {
  Canvas c(4, 4, 16, 16, 0.0F);
  c.rectangle(15, -1, 17, 1, 1.0F);
  for (const auto& [x, y] :
       {std::pair{15, 15}, std::pair{0, 15}, std::pair{15, 0}, std::pair{0, 0}})
    EXPECT_EQ(c.at(x, y), 1.0F);
  EXPECT_NEAR(mean(c), 4.0 / 256, 1e-6);
}

TEST(Canvas, noiseIsPeriodicAndNeverFinerThanThreeTexels) {
  Canvas c(6, 6, 1, 1, 0.5F);
  c.noise(1e-6, 1e-6, 0.4F, 3);
  // Value noise of cells three texels wide moves by at most 2·amplitude·max slope (15/8) / 3 per
  // texel, across the seam too.
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      EXPECT_LE(std::abs(c.at((x + 1) % 64, y) - c.at(x, y)), 2 * 0.4F * 1.875F / 3 + 1e-4F);
}

TEST(TextureAtlas, levelsKeepTheMeanAndWordsHoldTheirNeighbours) {
  Canvas c(4, 3, 1, 1, 0.3F);
  c.noise(0.25, 0.25, 0.25F, 1);
  TextureAtlas atlas;
  (void)atlas.add(Canvas(1, 1, 1, 1, 0.0F));
  const TextureRef ref = atlas.add(c);
  EXPECT_EQ(ref.base, 16);
  const std::int32_t* words = atlas.words() + ref.base;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 16; ++x) {
      const std::int32_t w = words[y * 32 + x];
      EXPECT_EQ(byte(w, 0), std::lround(255 * c.at(x, y)));
      EXPECT_EQ(byte(w, 1), std::lround(255 * c.at((x + 1) % 16, y)));
      EXPECT_EQ(byte(w, 2), std::lround(255 * c.at(x, (y + 1) % 8)));
      EXPECT_EQ(byte(w, 3), std::lround(255 * c.at((x + 1) % 16, (y + 1) % 8)));
    }
  // The last level of both axes, one texel: the picture's mean.
  const std::int32_t last = words[(16 - (16 >> 3)) * 32 + (32 - (32 >> 4))];
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(byte(last, k), 255 * mean(c), 0.51);
}

TEST(TextureAtlas, halvingRemovesWhatTheNextLevelCannotHold) {
  // Taps 1 3 3 1 pass cos³(π/period) of a wave: a third at the next level's Nyquist frequency,
  // nearly all of a slow one.
  for (const int period : {4, 16}) {
    const double gain = std::pow(std::cos(std::numbers::pi / period), 3);
    Canvas c(6, 2, 1, 1, 0.0F);
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 64; ++x)
        c.at(x, y) =
            static_cast<float>(0.5 + 0.4 * std::cos(2 * std::numbers::pi * (x + 0.5) / period));
    TextureAtlas atlas;
    const TextureRef ref = atlas.add(c);
    for (int x = 0; x < 32; ++x) {
      const double expected =
          0.5 + 0.4 * gain * std::cos(2 * std::numbers::pi * (2 * x + 1) / period);
      EXPECT_NEAR(byte(atlas.words()[ref.base + 64 + x], 0), 255 * expected, 0.51) << period;
    }
  }
}

}  // namespace
}  // namespace vergence::mock
