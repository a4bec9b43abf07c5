#include "core/features/epipolar_search.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "core/memory/allocation_guard.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::features {
namespace {

using test::Built;
using test::draw;
using test::Image;
using test::Texture;

constexpr int kWidth = 480, kHeight = 320;
using Grey = std::function<double(const Vec2&)>;

Intrinsics lens(bool distorted) {
  Intrinsics k;
  k.width = kWidth;
  k.height = kHeight;
  k.fx = 400;
  k.fy = 404;
  k.cx = 236.4;
  k.cy = 163.1;
  if (distorted) k.distortion = {-0.28, 0.07, 0.0004, -0.0003, 0};
  return k;
}

/// Two cameras before a wall at depth `depth` (m, in left), painted with a function of the ideal
/// left pixel.
struct Wall {
  Camera left, right;
  Transform T_right_left;
  double depth;
  Image left_image, right_image;
  Built left_built, right_built;

  Wall(const Grey& paint, double depth_m, bool distorted, const Transform& T,
       const Grey& right_paint = {})
      : left(lens(distorted)),
        right(lens(distorted)),
        T_right_left(T),
        depth(depth_m),
        left_image(draw(kWidth, kHeight,
                        [&](const Vec2& p) { return paint(on_wall(left, Transform{}, p)); })),
        right_image(draw(kWidth, kHeight,
                         [&](const Vec2& p) {
                           return (right_paint ? right_paint : paint)(on_wall(right, T, p));
                         })),
        left_built(left_image.view()),
        right_built(right_image.view()) {}

  /// Where a pixel's ray meets the wall, px of an ideal left camera.
  [[nodiscard]] Vec2 on_wall(const Camera& camera, const Transform& T_camera_left,
                             const Vec2& pixel) const {
    Vec3 ray;
    if (!camera.unproject(pixel, &ray)) return Vec2::Zero();
    const Transform back = T_camera_left.inverse();
    const Vec3 direction = back.R * ray;
    const Vec3 hit = back.t + (depth - back.t.z()) / direction.z() * direction;
    return 400.0 / depth * hit.head<2>();
  }
  [[nodiscard]] EpipolarCurve curve(const Vec2& pixel) const {
    EpipolarCurve c{&right, T_right_left, Vec3::Zero()};
    EXPECT_TRUE(left.unproject(pixel, &c.ray));
    return c;
  }
  [[nodiscard]] SearchResult search(const Vec2& pixel, const EpipolarSearchOptions& options) const {
    Patch patch{};
    EXPECT_TRUE(cut_patch(left_built.pyramid, pixel, &patch));
    return search_along(patch, right_built.pyramid, curve(pixel), options);
  }
};

Transform beside() { return {Mat3::Identity(), Vec3(-0.5, 0, 0)}; }
Transform turned() { return {exp_so3(Vec3(0.01, -0.015, 0.02)), Vec3(-0.5, 0.02, 0.03)}; }

EpipolarSearchOptions to_two_metres() {
  EpipolarSearchOptions o;
  o.rho_last = 0.5;
  return o;
}

TEST(EpipolarSearch, depthIsFoundToAPixelOfItsLevel) {
  for (const bool distorted : {false, true})
    for (const Transform& T : {beside(), turned()})
      for (const double depth : {4.0, 11.0, 60.0}) {
        const Wall wall(Texture(3), depth, distorted, T);
        int found = 0;
        for (const Vec2& pixel :
             {Vec2(220, 160), Vec2(300, 90), Vec2(260, 240), Vec2(180, 200), Vec2(340, 170)}) {
          const SearchResult r = wall.search(pixel, to_two_metres());
          if (r.status != SearchStatus::ok) continue;
          ++found;
          Vec2 real, at;
          ASSERT_EQ(wall.curve(pixel).at(1 / depth, &real, nullptr), ProjectStatus::ok);
          ASSERT_EQ(wall.curve(pixel).at(r.rho, &at, nullptr), ProjectStatus::ok);
          // A step along the curve is one pixel of level 1, and so is a pixel across: the diagonal;
          // the foot is rounded once more.
          EXPECT_LT((r.pixel - real).norm(), 2.0 * std::numbers::sqrt2)
              << depth << " m, distorted " << distorted;
          EXPECT_LT((at - real).norm(), 4.0) << depth << " m, distorted " << distorted;
        }
        EXPECT_GE(found, 4) << depth << " m, distorted " << distorted;
      }
}

TEST(EpipolarSearch, longCurveIsSearchedCompletely) {
  // From infinity to 1/6 m the curve is 1200 px long, 600 of level 1.
  const Wall wall(Texture(7, 8, 20), 20.0, false, beside());
  EpipolarSearchOptions usual, near;
  near.rho_last = 6;
  near.unique = usual.unique = 1.F;
  int found = 0, found_usual = 0;
  for (double y = 40; y < kHeight - 40; y += 20)
    for (double x = 60; x < kWidth - 40; x += 20) {
      constexpr double kDisparity = 400 * 0.5 / 20;
      const auto right = [&](const SearchResult& r) {
        return r.status == SearchStatus::ok && std::abs(r.pixel.x() - (x - kDisparity)) < 4;
      };
      found_usual += right(wall.search({x, y}, usual)) ? 1 : 0;
      found += right(wall.search({x, y}, near)) ? 1 : 0;
    }
  EXPECT_GT(found_usual, 100);
  EXPECT_GT(found, 9 * found_usual / 10);
}

TEST(EpipolarSearch, repeatedPatternIsAmbiguous) {
  const auto fence = [](const Vec2& p) {
    return 128 + 60 * std::cos(p.x() * 2 * std::numbers::pi / 24) *
                     std::cos(p.y() * 2 * std::numbers::pi / 40);
  };
  const Wall wall(fence, 8.0, false, beside());
  for (const Vec2& pixel : {Vec2(260, 160), Vec2(240, 100), Vec2(300, 220)})
    EXPECT_EQ(wall.search(pixel, to_two_metres()).status, SearchStatus::ambiguous);
}

TEST(EpipolarSearch, patchUnseenByTheOtherCameraIsUncorrelated) {
  const Wall wall(Texture(3), 8.0, false, beside(), Texture(77));
  int refused = 0;
  for (int i = 0; i < 30; ++i) {
    EpipolarSearchOptions strict = to_two_metres();
    strict.min_zncc = 0.95F;
    refused +=
        wall.search(Vec2(200 + 5 * i, 100 + 4 * i), strict).status == SearchStatus::uncorrelated
            ? 1
            : 0;
  }
  EXPECT_EQ(refused, 30);
}

TEST(EpipolarSearch, curveOutsideTheImageIsOffImage) {
  const Wall wall(Texture(3), 8.0, false, {exp_so3(Vec3(1.2, 0, 0)), Vec3(-0.5, 0, 0)});
  EXPECT_EQ(wall.search({240, 160}, to_two_metres()).status, SearchStatus::off_image);
  const Wall behind(Texture(3), 8.0, false, {exp_so3(Vec3(0, 3.1, 0)), Vec3(-0.5, 0, 0)});
  EXPECT_EQ(behind.search({240, 160}, to_two_metres()).status, SearchStatus::off_image);
}

TEST(EpipolarSearch, noByteOutsideTheImageIsRead) {
  const Wall wall(Texture(3), 20.0, false, beside());
  for (const auto guard : {test::GuardedImage::Guard::before, test::GuardedImage::Guard::behind}) {
    const test::GuardedImage guarded(wall.right_image, guard);
    const Built b(guarded.view());
    test::on_every_target([&](const char*) {
      for (const int x : {14, 60, kWidth - 15, kWidth - 14})
        for (int y = 14; y <= kHeight - 14; y += 3) {
          Patch patch{};
          ASSERT_TRUE(cut_patch(wall.left_built.pyramid, Vec2(x, y), &patch));
          // Turned so that curves run out at every side, on the image itself.
          for (const double tilt : {-0.35, 0.0, 0.35}) {
            EpipolarCurve c = wall.curve(Vec2(x, y));
            c.T_camera_left.R = exp_so3(Vec3(tilt, tilt, 0));
            EpipolarSearchOptions o = to_two_metres();
            o.band = 2;
            (void)search_along(patch, b.pyramid, c, o);
          }
        }
    });
  }
}

TEST(InverseDepth, fitGivesInverseDepthAndDistanceAcross) {
  for (const bool distorted : {false, true})
    for (const Transform& T : {beside(), turned()}) {
      const Camera right(lens(distorted)), left(lens(distorted));
      EpipolarCurve c{&right, T, Vec3::Zero()};
      ASSERT_TRUE(left.unproject({300, 200}, &c.ray));
      for (const double rho : {0.005, 0.1, 0.25}) {
        Vec2 pixel;
        Mat23 J;
        ASSERT_EQ(c.at(rho, &pixel, &J), ProjectStatus::ok);
        const Vec2 tangent = J * T.t;
        const Vec2 normal = Vec2(-tangent.y(), tangent.x()).normalized();
        for (const double off : {0.0, 0.7}) {
          double value = 0.12, sigma = 0;
          // Gauss–Newton ends where its fourth step is below the curve's own bend: with 0.7 px off,
          // 1e-4 px.
          EXPECT_NEAR(fit_inverse_depth(c, pixel + off * normal, &value, &sigma), off, 1e-4);
          EXPECT_NEAR(value, rho, 1e-4 * sigma + 1e-9 + (off > 0 ? 1e-3 * rho : 0));
          // One pixel along the curve is that much inverse depth.
          Vec2 next;
          ASSERT_EQ(c.at(rho + 0.01 * sigma, &next, nullptr), ProjectStatus::ok);
          EXPECT_NEAR((next - pixel).norm(), 0.01, 1e-4);
        }
      }
    }
}

TEST(InverseDepth, missingBaselineOrPointBehindHasNoDepth) {
  const Camera camera(lens(false));
  double rho = 0.1, sigma = 0;
  const EpipolarCurve no_baseline{&camera, Transform{}, Vec3(0, 0, 1)};
  EXPECT_LT(fit_inverse_depth(no_baseline, {200, 160}, &rho, &sigma), 0);
  const EpipolarCurve behind{&camera, {exp_so3(Vec3(0, 3.1, 0)), Vec3(-0.5, 0, 0)}, Vec3(0, 0, 1)};
  EXPECT_LT(fit_inverse_depth(behind, {200, 160}, &rho, &sigma), 0);
  EXPECT_EQ(rho, 0.1);
}

}  // namespace
}  // namespace vergence::features
