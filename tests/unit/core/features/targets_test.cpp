#include <gtest/gtest.h>

#include <string>

#include "core/features/detail/align_kernel.hpp"
#include "core/features/detail/correlate_kernel.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::features::detail {
namespace {

TEST(FeatureTargets, correlationsAreEqualOnEveryTarget) {
  const test::Image image = test::white_noise(200, 40, 8, 64);
  const test::Image texture = test::white_noise(kBlock, kBlock, 9);
  Block block;
  float square = 0;
  for (int i = 0; i < kBlock * kBlock; ++i) {
    block.pixels[i] = texture.bytes[static_cast<std::size_t>(i)];
    block.sum += block.pixels[i];
    square += static_cast<float>(block.pixels[i] * block.pixels[i]);
  }
  block.variance = kBlock * kBlock * square - block.sum * block.sum;
  std::vector<std::int32_t> offsets;
  for (int i = 0; i < 117; ++i)
    offsets.push_back(static_cast<std::int32_t>((i % 29) * image.stride + i));
  std::vector<float> scores(offsets.size() + kPlacesAtATime);
  test::on_every_target([&](const char* target) {
    correlate(block, image.bytes.data(), image.stride, offsets.data(),
              static_cast<int>(offsets.size()), scores.data());
    vergence::test::Fingerprint bits;
    for (std::size_t i = 0; i < offsets.size(); ++i) bits.add(scores[i]);
    EXPECT_EQ(bits.value(), 0xf53deb61411f2590U) << target << std::hex << ": 0x" << bits.value();
  });
}

/// Where a product and a sum are one instruction everywhere in a window, its bits do not depend on
/// the target, nor on the machine: those of AVX2, AVX3 and NEON.
TEST(FeatureTargets, windowsAreBitIdenticalWithFusedProducts) {
  const test::Image patch = test::white_noise(kPatchSide, kPatchSide + 4, 11);
  const test::Image image = test::white_noise(64, 64, 13, 64);
  const float turned[4] = {0.96F, -0.2F, 0.21F, 1.03F};
  int fused = 0;
  test::on_every_target([&](const char* target) {
    const std::string name = target;
    if (name != "NEON" && !name.starts_with("AVX")) return;
    ++fused;
    Window w;
    make_window(patch.bytes.data(), 13.7F, 13.2F, turned, &w);
    WindowSums sums{};
    window_sums(w, image.bytes.data() + 20 * image.stride + 20, image.stride, 0.3F, 0.85F, &sums);
    vergence::test::Fingerprint bits;
    bits.add(std::span<const float>(w.value));
    bits.add(std::span<const float>(w.steep_x));
    bits.add(std::span<const float>(w.steep_y));
    for (const float x : {w.variance_sum, w.hxx, w.hxy, w.hyy, sums.steep_x, sums.steep_y,
                          sums.value, sums.sum, sums.square})
      bits.add(x);
    EXPECT_EQ(bits.value(), 0xad232a4b8e8150c5U) << target << std::hex << ": 0x" << bits.value();
  });
  if (fused == 0) GTEST_SKIP() << "needs a processor with AVX2 or NEON";
}

}  // namespace
}  // namespace vergence::features::detail
