#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/features/detail/align_kernel.hpp"
#include "core/features/detail/corner_kernel.hpp"
#include "core/features/detail/correlate_kernel.hpp"
#include "core/features/detail/downsample.hpp"
#include "core/features/pyramid.hpp"
#include "tests/support/simd_targets.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::features::detail {
namespace {

using vergence::test::Fingerprint;

constexpr float kEpsilon = std::numeric_limits<float>::epsilon();

/// Results of a float kernel on every target against those of the first.
class Spread {
 public:
  void see(const char* target, const std::vector<float>& values, float bound) {
    if (first_.empty()) first_ = values;
    ASSERT_EQ(values.size(), first_.size());
    float worst = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      worst = std::max(worst, std::abs(values[i] - first_[i]));
    EXPECT_LE(worst, bound) << target;
  }

 private:
  std::vector<float> first_;
};

TEST(FeatureTargets, halvingAnImageGivesTheSameBitsOnEveryMachine) {
  // An odd size, so that the last vector of a row is partly padding.
  const test::Image image = test::white_noise(333, 125, 7, 64);
  test::Image half(166, 62, 64);
  std::vector<std::uint16_t> row(filtered_row_length(image.width));
  test::on_every_target([&](const char* target) {
    std::fill(half.bytes.begin(), half.bytes.end(), std::uint8_t{0});
    downsample(image.view(), half.bytes.data(), half.view(), row.data());
    Fingerprint bits;
    for (int y = 0; y < half.height; ++y)
      for (int x = 0; x < half.width; ++x) bits.add(half.at(x, y));
    EXPECT_EQ(bits.value(), 0x3383b33430026c58U) << target << std::hex << ": 0x" << bits.value();
  });
}

TEST(FeatureTargets, correlationSumsAreTheSameOnEveryMachine) {
  const test::Image image = test::white_noise(200, 40, 8, 64);
  const test::Image block = test::white_noise(kBlock, kBlock, 9);
  std::vector<std::int32_t> offsets;
  for (int i = 0; i < 117; ++i)
    offsets.push_back(static_cast<std::int32_t>((i % 29) * image.stride + i));
  std::vector<BlockSums> sums(offsets.size());
  test::on_every_target([&](const char* target) {
    correlate(block.bytes.data(), image.bytes.data(), image.stride, offsets.data(),
              static_cast<int>(offsets.size()), sums.data());
    Fingerprint bits;
    for (const BlockSums& s : sums) {
      bits.add(s.product);
      bits.add(s.sum);
      bits.add(s.square);
    }
    EXPECT_EQ(bits.value(), 0xee14f44fcbb708b7U) << target << std::hex << ": 0x" << bits.value();
  });
}

/// Sums of quarters are exact; what follows are four roundings of numbers up to the largest mean
/// square gradient of a row and a column, 127.5².
TEST(FeatureTargets, cornerScoresDifferByFourRoundings) {
  constexpr int kSide = 100, kFirst = 12;
  constexpr float kLargest = 127.5F * 127.5F;
  const test::Image image = test::white_noise(kSide + 2 * kFirst, kSide + 2 * kFirst, 10, 64);
  Spread spread;
  test::on_every_target([&](const char* target) {
    std::vector<float> score(static_cast<std::size_t>(kMaxBlock) * kMaxBlock), kept;
    corner_scores(image.view(), kFirst, kFirst, kSide, kSide, score.data());
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        kept.push_back(score[static_cast<std::size_t>(y * kMaxBlock + x)]);
    spread.see(target, kept, 4 * kEpsilon * kLargest);
  });
}

/// Where a product and a sum are one instruction everywhere in a window, its bits do not depend on
/// the target, nor on the machine: those of AVX2, AVX3 and NEON.
TEST(FeatureTargets, windowsHaveTheSameBitsWhereProductsAreFused) {
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
    Fingerprint bits;
    bits.add(std::span<const float>(w.value));
    bits.add(std::span<const float>(w.steep_x));
    bits.add(std::span<const float>(w.steep_y));
    for (const float x : {w.variance_sum, w.hxx, w.hxy, w.hyy, sums.steep_x, sums.steep_y,
                          sums.value, sums.sum, sums.square})
      bits.add(x);
    EXPECT_EQ(bits.value(), 0xad232a4b8e8150c5U) << target << std::hex << ": 0x" << bits.value();
  });
  if (fused == 0) GTEST_SKIP() << "this machine has none of them";
}

/// A place in the patch is rounded twice, at most kPatchSide px from its corner; between two pixels
/// that differ by 255 grey levels that moves a bilinear value by so much, and its mean and slope
/// by no more again.
TEST(FeatureTargets, windowsDifferByTheRoundingOfAPlace) {
  constexpr float kValue = 2 * kEpsilon * kPatchSide * 255.F;
  const test::Image patch = test::white_noise(kPatchSide, kPatchSide + 4, 11);
  const float turned[4] = {0.96F, -0.2F, 0.21F, 1.03F};
  Spread values, slopes;
  test::on_every_target([&](const char* target) {
    Window w;
    make_window(patch.bytes.data(), 13.7F, 13.2F, turned, &w);
    values.see(target, {std::begin(w.value), std::end(w.value)}, 4 * kValue);
    std::vector<float> both(std::begin(w.steep_x), std::end(w.steep_x));
    both.insert(both.end(), std::begin(w.steep_y), std::end(w.steep_y));
    slopes.see(target, both, 8 * kValue);
  });
}

/// Sums of kWindow² products: each rounded to half an epsilon of a sum that never passes the sum of
/// the magnitudes.
TEST(FeatureTargets, windowSumsDifferByTheRoundingOfTheirTerms) {
  const test::Image patch = test::white_noise(kPatchSide, kPatchSide + 4, 12);
  const test::Image image = test::white_noise(64, 64, 13, 64);
  const float upright[4] = {1, 0, 0, 1};
  Window w;  // one for all targets: only the sums are compared
  make_window(patch.bytes.data(), 13.5F, 13.5F, upright, &w);
  float steep = 0, value = 0;
  for (int i = 0; i < kWindow * kWindowStride; ++i) {
    steep += (std::abs(w.steep_x[i]) + std::abs(w.steep_y[i])) * 255.F;
    value += std::abs(w.value[i]) * 255.F;
  }
  constexpr float kTerms = kWindow * kWindow;
  Spread steeps, products, sums, squares;
  test::on_every_target([&](const char* target) {
    WindowSums s{};
    window_sums(w, image.bytes.data() + 20 * image.stride + 20, image.stride, 0.3F, 0.85F, &s);
    const float rounding = kTerms * kEpsilon;
    steeps.see(target, {s.steep_x, s.steep_y}, rounding * steep);
    products.see(target, {s.value}, rounding * value);
    sums.see(target, {s.sum}, rounding * kTerms * 255.F);
    squares.see(target, {s.square}, rounding * kTerms * 255.F * 255.F);
  });
}

}  // namespace
}  // namespace vergence::features::detail
