#include "core/features/patch.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "core/features/descriptor.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::features {
namespace {

using namespace test;

constexpr int kWidth = 180, kHeight = 160;
// Without noise but rounding to 8 bits (0.29 grey levels). A window's information is some thousand
// (grey levels / px)², which makes 0.01 px of that; bilinear interpolation of waves down to 8 px
// adds as much, and steps end below 0.01 px.
constexpr double kSubPixel = 0.02;

/// A texture and its patch cut at a pixel.
struct Scene {
  Texture texture;
  Image image;
  Built built;
  Patch patch{};
  Vec2 at;
  explicit Scene(std::uint64_t seed, Vec2 where = {90, 80})
      : texture(seed),
        image(draw(kWidth, kHeight, texture)),
        built(image.view()),
        at(std::move(where)) {
    EXPECT_TRUE(cut_patch(built.pyramid, at, &patch));
  }
};

AlignResult align_in(const Image& image, const Patch& patch, const Vec2& predicted,
                     const Mat2& A = Mat2::Identity(), const AlignOptions& options = {}) {
  const Built b(image.view());
  return align(patch, b.pyramid, predicted, A, options);
}

TEST(Patch, shiftIsFoundToAFiftiethOfAPixel) {
  constexpr int kCases = 60;
  Random random(11);
  std::array<double, 8> square{};
  for (int i = 0; i < kCases; ++i) {
    const Scene s(static_cast<std::uint64_t>(i) + 1, {85.0 + i % 7, 75.0 + i % 5});
    // Less than half of the shortest wave: further away another minimum is as near.
    const Vec2 shift(random.uniform(-2.5, 2.5), random.uniform(-2.5, 2.5));
    const Image moved = draw(kWidth, kHeight, [&](const Vec2& p) { return s.texture(p - shift); });
    const Built b(moved.view());
    std::size_t t = 0;
    test::on_every_target([&](const char* target) {
      const AlignResult r = align(s.patch, b.pyramid, s.at, Mat2::Identity(), {});
      ASSERT_EQ(r.status, AlignStatus::ok) << target << ", case " << i;
      const double error = (r.pixel - s.at - shift).norm();
      EXPECT_LT(error, 4 * kSubPixel) << target << ", case " << i << ", "
                                      << "sigma " << r.sigma;
      square[t++] += error * error;
      EXPECT_GT(r.zncc, 0.99F);
    });
  }
  for (const double sum : square) EXPECT_LT(std::sqrt(sum / kCases), kSubPixel);
}

TEST(Patch, subpixelAnchorIsKeptOnEveryLevel) {
  for (const Vec2& at : {Vec2(90.3, 79.8), Vec2(89.5, 80.5), Vec2(91, 83), Vec2(92.75, 81.25)}) {
    const Scene s(3, at);
    for (int level = 0; level < s.patch.levels; ++level) {
      AlignOptions only{.coarsest = level, .finest = level};
      const AlignResult r = align(s.patch, s.built.pyramid, at, Mat2::Identity(), only);
      ASSERT_EQ(r.status, AlignStatus::ok) << level;
      EXPECT_LT((r.pixel - at).norm(), std::ldexp(kSubPixel, level)) << "level " << level;
    }
  }
}

TEST(Patch, rotatedAndScaledPatchIsFound) {
  Random random(5);
  double square = 0;
  int cases = 0;
  for (const double angle_deg : {-20.0, 10.0, 40.0})
    for (const double scale : {0.75, 1.0, 1.3})
      for (const double shear : {0.0, 0.2}) {
        const Scene s(static_cast<std::uint64_t>(cases) + 40);
        const double a = angle_deg * std::numbers::pi / 180;
        Mat2 A;
        A << std::cos(a), -std::sin(a) + shear, std::sin(a), std::cos(a);
        A *= scale;
        // One after the other: the order of arguments is the compiler's, and not that of every
        // machine.
        const double down = random.uniform(-3, 3), right = random.uniform(-3, 3);
        const Vec2 there = s.at + Vec2(right, down);
        const Mat2 back = A.inverse();
        const Image warped = draw(
            kWidth, kHeight, [&](const Vec2& p) { return s.texture(s.at + back * (p - there)); });
        const AlignResult r = align_in(warped, s.patch, s.at, A);
        ASSERT_EQ(r.status, AlignStatus::ok) << angle_deg << "°, " << scale;
        const double error = (r.pixel - there).norm();
        EXPECT_LT(error, 4 * kSubPixel) << angle_deg << "°, " << scale << ", shear " << shear;
        square += error * error;
        ++cases;
      }
  // Both images are interpolated here, each with the bias of its own.
  EXPECT_LT(std::sqrt(square / cases), 1.5 * kSubPixel);
}

TEST(Patch, sigmaMatchesTheErrorDueToNoise) {
  // One grey level of noise in the image (with the rounding 1.04), a clean patch: along the worst
  // direction the error's sigma is the stated one, along the other it is less, so the whole lies
  // between one and √2 of it. 200 cases know it to 5 %; kSettled and interpolation add 0.02 px.
  double square = 0, predicted = 0;
  constexpr int kCases = 200;
  constexpr double kNoise = 4.0;
  for (int i = 0; i < kCases; ++i) {
    const Scene s(static_cast<std::uint64_t>(i) + 1);
    Random random(static_cast<std::uint64_t>(i) + 900);
    const Image noisy = draw(
        kWidth, kHeight, [&](const Vec2& p) { return s.texture(p) + kNoise * random.normal(); });
    AlignOptions only{.coarsest = 0};
    const AlignResult r = align_in(noisy, s.patch, s.at, Mat2::Identity(), only);
    ASSERT_EQ(r.status, AlignStatus::ok);
    square += (r.pixel - s.at).squaredNorm() / (kNoise * kNoise);
    predicted += static_cast<double>(r.sigma) * static_cast<double>(r.sigma);
  }
  const double ratio = std::sqrt(square / predicted);
  EXPECT_GT(ratio, 0.9);
  EXPECT_LT(ratio, 1.1 * std::numbers::sqrt2);
}

TEST(Patch, positionOutsideTheImageIsOutside) {
  const Scene s(1);
  for (const Vec2& at : {Vec2(3, 80), Vec2(kWidth - 3, 80), Vec2(90, 2), Vec2(90, kHeight - 2),
                         Vec2(-50, -50), Vec2(1e6, 5), Vec2(NAN, 5)})
    EXPECT_EQ(align(s.patch, s.built.pyramid, at, Mat2::Identity(), {}).status,
              AlignStatus::outside);
}

TEST(Patch, patchWithoutTwoDimensionalTextureIsFlat) {
  const Image plain = draw(kWidth, kHeight, [](const Vec2&) { return 100.0; });
  const Image stripes =
      draw(kWidth, kHeight, [](const Vec2& p) { return 128 + 60 * std::sin(p.x() / 3); });
  for (const Image* image : {&plain, &stripes}) {
    const Built b(image->view());
    Patch patch{};
    ASSERT_TRUE(cut_patch(b.pyramid, {90, 80}, &patch));
    EXPECT_EQ(align(patch, b.pyramid, {90, 80}, Mat2::Identity(), {}).status, AlignStatus::flat);
  }
}

TEST(Patch, shiftBeyondTheLimitDiverges) {
  const Scene s(2);
  const Image moved =
      draw(kWidth, kHeight, [&](const Vec2& p) { return s.texture(p - Vec2(5, 0)); });
  AlignOptions options{.max_shift = 2};
  EXPECT_EQ(align_in(moved, s.patch, s.at, Mat2::Identity(), options).status,
            AlignStatus::diverged);
  EXPECT_EQ(align(s.patch, s.built.pyramid, s.at, Mat2::Zero(), {}).status, AlignStatus::diverged);
  EXPECT_EQ(align(s.patch, s.built.pyramid, s.at, 100 * Mat2::Identity(), {}).status,
            AlignStatus::diverged);
}

TEST(Patch, otherTextureOrNegativeIsNotMatched) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    // Waves of 4 to 9 px fill a window with some thirty independent values: a correlation of 0.8 by
    // chance would be four sigmas and more.
    const Image image = draw(kWidth, kHeight, Texture(seed, 4, 9));
    const Built b(image.view());
    Patch patch{};
    ASSERT_TRUE(cut_patch(b.pyramid, {90, 80}, &patch));
    const AlignResult r = align_in(draw(kWidth, kHeight, Texture(seed + 1000, 4, 9)), patch,
                                   {90, 80}, Mat2::Identity(), {.min_zncc = 0.8F});
    EXPECT_NE(r.status, AlignStatus::ok) << seed;
  }
  // The negative has the right edges in the right places.
  const Scene s(1);
  EXPECT_NE(align_in(draw(kWidth, kHeight, [&](const Vec2& p) { return 255 - s.texture(p); }),
                     s.patch, s.at, Mat2::Identity(), {.min_zncc = 0.8F})
                .status,
            AlignStatus::ok);
}

TEST(Patch, noByteOutsideTheImageIsRead) {
  const Texture texture(6);
  constexpr int kSide = 101;
  const Image image = draw(kSide, kSide, texture);
  const Image big = draw(kWidth, kHeight, texture);
  const Built from(big.view());
  Patch patch{};
  ASSERT_TRUE(cut_patch(from.pyramid, {50, 50}, &patch));
  for (const auto guard : {test::GuardedImage::Guard::before, test::GuardedImage::Guard::behind}) {
    const test::GuardedImage guarded(image, guard);
    const Built b(guarded.view(), 2);
    test::on_every_target([&](const char*) {
      AlignOptions options{.min_zncc = -1.F};
      // Every position along two borders and across all four corners, in odd steps of a pixel.
      for (double along = -2; along < kSide + 2; along += 0.37)
        for (const double stereo : {4.6, 5.5, 6.49, 84.9, 93.2, 94.3, 95.6}) {
          (void)align(patch, b.pyramid, {along, stereo}, Mat2::Identity(), options);
          (void)align(patch, b.pyramid, {stereo, along}, Mat2::Identity(), options);
        }
      for (int y = 0; y < kSide; ++y)
        for (const int x : {13, 14, 50, kSide - 15, kSide - 14, kSide - 13}) {
          Patch cut{};
          (void)cut_patch(b.pyramid, Vec2(x, y), &cut);
          (void)cut_patch(b.pyramid, Vec2(y + 0.49, x - 0.5), &cut);
        }
    });
  }
}

/// The descriptor at the middle of a picture.
template <class Value>
Descriptor of(const Value& value) {
  const test::Image image = draw(120, 120, value);
  const test::Built built(image.view());
  Patch patch{};
  EXPECT_TRUE(cut_patch(built.pyramid, {60, 60}, &patch));
  return describe(patch);
}

TEST(Descriptor, changedViewIsNearerThanAnyOtherPlace) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Texture texture(seed);
    const Descriptor here = of(texture);
    Random random(seed);
    const double angle = 10 * std::numbers::pi / 180;
    Mat2 turn;
    turn << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    const Vec2 middle(60, 60);
    const int noisy = distance(
        here, of([&](const Vec2& p) { return 0.7 * texture(p) + 20 + 5 * random.normal(); }));
    const int turned = distance(
        here, of([&](const Vec2& p) { return texture(middle + 1.1 * (turn * (p - middle))); }));
    int other = 256;
    for (std::uint64_t k = 1; k <= 10; ++k)
      other = std::min(other, distance(here, of(Texture(1000 + 10 * seed + k))));
    EXPECT_LT(noisy, other) << seed;
    EXPECT_LT(turned, other) << seed;
  }
}

}  // namespace
}  // namespace vergence::features
