#include "core/features/surf.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "core/features/detail/surf_hessian.hpp"
#include "core/features/surf_match.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::features {
namespace {

using test::draw;
using test::Image;

constexpr double kDegree = std::numbers::pi / 180;

struct Blob {
  Vec2 at;
  double sigma;      // px
  double amplitude;  // grey levels
};

/// Gaussian blobs on a grey ground.
struct Blobs {
  std::vector<Blob> blobs;
  [[nodiscard]] double operator()(const Vec2& p) const {
    double v = 128;
    for (const Blob& b : blobs)
      v += b.amplitude * std::exp(-0.5 * (p - b.at).squaredNorm() / (b.sigma * b.sigma));
    return v;
  }
};

/// Points and descriptors of a picture, with the memory they lie in.
struct Described {
  Described(const Image& image, std::size_t capacity, const SurfOptions& options)
      : surf(image.width, image.height, arena), points(arena.make<SurfPoint>(capacity, "points")) {
    EXPECT_EQ(surf.set_image(image.view()), SurfStatus::ok);
    found = surf.detect(options, &points);
    descriptors.resize(points.size());
    surf.describe(points.span(), descriptors);
  }
  [[nodiscard]] SurfView view() const { return {points.span(), descriptors}; }
  Arena arena;
  Surf surf;
  BoundedVector<SurfPoint> points;
  std::vector<SurfDescriptor> descriptors;
  int found = 0;
};

double distance(const SurfDescriptor& a, const SurfDescriptor& b) {
  double square = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const double d = static_cast<double>(a.values[i]) - static_cast<double>(b.values[i]);
    square += d * d;
  }
  return std::sqrt(square);
}

/// Uses the octave whose inner sizes contain a blob: boxes of some 5.2 σ answer it most; those of
/// 12 … 24, 21 … 45, 39 … 87 px can be a maximum.
double places_apart(double sigma) { return 5.2 * sigma < 21 ? 1 : 5.2 * sigma < 42 ? 2 : 4; }

// Along one size the determinant of a blob falls like a Gaussian of w² = (σ² + s²)/4, symmetric
// about its centre. A parabola through three samples h apart of such a top misses it by at most
// 0.048 h³/w² (from its series, h δ (δ² − 1/4) h²/w², δ h the top's place between the samples);
// boxes make a coarser top than the Gaussian's derivatives: twice that. Rounded grey values: 0.02
// px.
TEST(Surf, blobIsFoundAtItsSubpixelPosition) {
  Random random(5);
  for (const double sigma : {2.5, 3.0, 3.6, 5.5, 6.5, 7.5, 10.0, 13.0}) {
    for (int i = 0; i < 8; ++i) {
      const Blob blob{
          {random.uniform(80, 84), random.uniform(80, 84)}, sigma, i % 2 == 0 ? 90.0 : -90.0};
      const Described d(draw(161, 165, Blobs{{blob}}), 50, SurfOptions{});
      ASSERT_GE(d.points.size(), 1U) << sigma;
      const SurfPoint& p = d.points[0];
      const double h = places_apart(sigma), s = static_cast<double>(p.scale);
      const double tolerance = 0.02 + 2 * 0.048 * h * h * h / ((sigma * sigma + s * s) / 4);
      EXPECT_NEAR(static_cast<double>(p.x), blob.at.x(), tolerance) << sigma;
      EXPECT_NEAR(static_cast<double>(p.y), blob.at.y(), tolerance) << sigma;
      EXPECT_EQ(p.dark, blob.amplitude < 0);
    }
  }
}

/// Matches of a picture with itself moved, turned and enlarged: where each left point went is
/// known.
struct Moved {
  int matches = 0, right = 0;
};

Moved match_moved(const Vec2& shift, double degrees, double larger) {
  constexpr int kWhole = 260;
  const Vec2 middle(130, 130);
  Mat2 turn;
  turn << std::cos(degrees * kDegree), -std::sin(degrees * kDegree), std::sin(degrees * kDegree),
      std::cos(degrees * kDegree);
  Moved m;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    // Waves of many lengths: one length alone has no size of its own.
    const test::Texture fine(seed, 9, 40), coarse(seed + 50, 20, 120);
    const auto brightness = [&](const Vec2& p) { return 0.6 * fine(p) + 0.9 * coarse(p) - 64; };
    const auto again = [&](const Vec2& p) {
      return brightness(middle + turn.transpose() * (p - middle - shift) / larger);
    };
    SurfOptions options{.min_response = 1};
    const Described left(draw(kWhole, kWhole, brightness), 600, options),
        right(draw(kWhole, kWhole, again), 600, options);
    Arena arena;
    SurfMatcher matcher(600, arena);
    BoundedVector<SurfMatch> matches(arena.make<SurfMatch>(600, "matches"));
    EXPECT_EQ(matcher.match(left.view(), right.view(), &matches), SurfMatchStatus::ok);
    for (const SurfMatch& match : matches) {
      const SurfPoint &a = left.points[match.left], &b = right.points[match.right];
      const Vec2 there =
          middle + shift +
          larger * (turn * (Vec2(static_cast<double>(a.x), static_cast<double>(a.y)) - middle));
      ++m.matches;
      // Within the finer of the two scales: the same blob.
      const double off = (there - Vec2(static_cast<double>(b.x), static_cast<double>(b.y))).norm();
      m.right += off < static_cast<double>(b.scale) ? 1 : 0;
    }
  }
  return m;
}

TEST(SurfMatcher, shiftedRotatedAndScaledImageIsMatched) {
  const Moved shifted = match_moved({7.3, -4.6}, 0, 1);
  EXPECT_GE(shifted.matches, 100);
  EXPECT_GE(shifted.right, 0.97 * shifted.matches);
  const Moved turned = match_moved({3, 5}, 10, 1);
  EXPECT_GE(turned.matches, 40);
  EXPECT_GE(turned.right, 0.9 * turned.matches);
  const Moved larger = match_moved({-4, 2}, 0, 1.3);
  EXPECT_GE(larger.matches, 25);
  EXPECT_GE(larger.right, 0.9 * larger.matches);
}

/// Two sets of points with descriptors of one number each: distances that can be read off.
struct Set {
  std::vector<SurfPoint> points;
  std::vector<SurfDescriptor> descriptors;
  void add(float x, float y, bool dark, double angle) {
    points.push_back({x, y, 2, 1, dark});
    SurfDescriptor d;
    d.values[0] = static_cast<float>(std::cos(angle));
    d.values[1] = static_cast<float>(std::sin(angle));
    descriptors.push_back(d);
  }
  [[nodiscard]] SurfView view() const { return {points, descriptors}; }
};

class Matching : public ::testing::Test {
 protected:
  Arena arena;
  SurfMatcher matcher{8, arena};
  BoundedVector<SurfMatch> out{arena.make<SurfMatch>(8, "matches")};
};

TEST_F(Matching, matchIsMutualUniqueAndOfOneSign) {
  Set left, right;
  left.add(0, 0, false, 0.00);   // nearest: right 0, which prefers left 1
  left.add(1, 0, false, 0.05);   // mutual with right 0
  left.add(2, 0, true, 1.00);    // nearest of its sign: right 2
  left.add(3, 0, false, 2.00);   // two equally near: refused
  left.add(4, 0, false, -1.50);  // too far from all
  right.add(0, 0, false, 0.06);
  right.add(0, 0, false, 1.01);
  right.add(0, 0, true, 1.10);
  right.add(0, 0, false, 1.80);
  right.add(0, 0, false, 2.20);
  ASSERT_EQ(matcher.match(left.view(), right.view(), &out), SurfMatchStatus::ok);
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(out[0].left, 1U);
  EXPECT_EQ(out[0].right, 0U);
  EXPECT_NEAR(out[0].distance, 2 * std::sin(0.005), 1e-6);
  EXPECT_EQ(out[1].left, 2U);
  EXPECT_EQ(out[1].right, 2U);
}

TEST_F(Matching, invalidInputGivesStatusAndNoMatch) {
  Set left, right;
  for (int i = 0; i < 9; ++i) left.add(0, 0, false, i);
  right.add(0, 0, false, 0);
  EXPECT_EQ(matcher.match(left.view(), right.view(), &out), SurfMatchStatus::capacity);
  EXPECT_TRUE(out.empty());
  left.points.pop_back();
  EXPECT_EQ(matcher.match(left.view(), right.view(), &out), SurfMatchStatus::invalid_input);
  left.descriptors.pop_back();
  EXPECT_EQ(matcher.match({}, right.view(), &out), SurfMatchStatus::ok);
  EXPECT_TRUE(out.empty());
  // Flat neighbourhoods resemble each other; what is not a number resembles nothing.
  left.descriptors.assign(8, {});
  right.descriptors.assign(1, {});
  EXPECT_EQ(matcher.match(left.view(), right.view(), &out), SurfMatchStatus::ok);
  EXPECT_TRUE(out.empty());
  right.descriptors[0].values.fill(std::numeric_limits<float>::quiet_NaN());
  left.descriptors[0].values.fill(1.F);
  EXPECT_EQ(matcher.match(left.view(), right.view(), &out), SurfMatchStatus::ok);
  EXPECT_TRUE(out.empty());
}

TEST(Surf, smallFlatOrInvalidImageHasNoPoint) {
  Arena arena;
  Surf surf(100, 80, arena);
  BoundedVector<SurfPoint> points(arena.make<SurfPoint>(50, "points"));
  EXPECT_EQ(surf.detect({}, &points), 0);  // no image yet
  for (const auto& [w, h] : {std::pair(1, 1), std::pair(26, 80), std::pair(27, 27),
                             std::pair(100, 3), std::pair(28, 29)}) {
    const Image noise = test::white_noise(w, h, 1);
    EXPECT_EQ(surf.set_image(noise.view()), SurfStatus::ok);
    EXPECT_EQ(surf.detect({}, &points), 0) << w << " x " << h;
    // A point outside the image has a descriptor of zeros.
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    for (const SurfPoint& outside :
         {SurfPoint{1e6F, -1e6F, 3, 1, false}, SurfPoint{kNaN, 1e30F, 3, 1, false},
          SurfPoint{5, 5, kNaN, 1, false}, SurfPoint{5, 5, 1e30F, 1, false}}) {
      SurfDescriptor d;
      surf.describe({&outside, 1}, {&d, 1});
      EXPECT_EQ(distance(d, {}), 0);
    }
  }
  for (const std::uint8_t grey : {std::uint8_t{0}, std::uint8_t{255}}) {
    Image flat(100, 80);
    std::fill(flat.bytes.begin(), flat.bytes.end(), grey);
    EXPECT_EQ(surf.set_image(flat.view()), SurfStatus::ok);
    EXPECT_EQ(surf.detect({-1}, &points), 0);
    EXPECT_EQ(surf.detect({std::numeric_limits<float>::quiet_NaN()}, &points), 0);
  }
  const Image large = test::white_noise(101, 80, 1);
  EXPECT_EQ(surf.set_image(large.view()), SurfStatus::too_large);
  EXPECT_EQ(surf.detect({}, &points), 0);
  EXPECT_EQ(surf.set_image({}), SurfStatus::invalid_image);
  EXPECT_EQ(surf.set_image({large.bytes.data(), 50, 50, 20}), SurfStatus::invalid_image);
  EXPECT_EQ(surf.set_image({large.bytes.data(), 50, -50, 50}), SurfStatus::invalid_image);
}

TEST(Surf, noByteOutsideTheImageIsRead) {
  for (const auto guard : {test::GuardedImage::Guard::before, test::GuardedImage::Guard::behind}) {
    const test::GuardedImage guarded(test::white_noise(131, 117, 9), guard);
    const Image padded = test::white_noise(131, 117, 9, 13, 200);
    Arena arena;
    Surf a(131, 117, arena), b(200, 20, arena);
    EXPECT_EQ(b.set_image(guarded.view()), SurfStatus::too_large);
    BoundedVector<SurfPoint> one(arena.make<SurfPoint>(300, "points")),
        two(arena.make<SurfPoint>(300, "points"));
    ASSERT_EQ(a.set_image(guarded.view()), SurfStatus::ok);
    EXPECT_GT(a.detect({0.1F}, &one), 0);
    ASSERT_EQ(a.set_image(padded.view()), SurfStatus::ok);
    a.detect({0.1F}, &two);
    ASSERT_EQ(one.size(), two.size());
    for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].response, two[i].response);
  }
}

}  // namespace
}  // namespace vergence::features
