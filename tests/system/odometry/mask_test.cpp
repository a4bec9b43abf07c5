#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/math/random.hpp"
#include "core/odometry/odometry.hpp"
#include "tests/system/odometry/stereo_drive.hpp"

namespace vergence::test {
namespace {

using features::test::Image;

constexpr std::size_t kFrames = 120;
/// Height in rows.
constexpr int kBonnet = 110;
const std::array<Eigen::Vector2i, 2> kDirt{Eigen::Vector2i(210, 170), Eigen::Vector2i(430, 205)};
/// Radius in px.
constexpr int kDirtRadius = 38;

/// Part of camera k's image that is not the street: the bonnet, dirt on the glass.
bool is_painted(std::size_t k, int x, int y, int height) {
  return y >= height - kBonnet ||
         (Eigen::Vector2i(x, y) - kDirt[k]).squaredNorm() < kDirtRadius * kDirtRadius;
}

/// Static things with more texture than the street has: rivets, grains, reflections.
Image paint(int width, int height) {
  Image p(width, height);
  Random random(7);
  for (int y = 0; y < height; y += 4)
    for (int x = 0; x < width; x += 4) {
      const auto grey = static_cast<std::uint8_t>(random.below(256));
      for (int v = y; v < std::min(y + 4, height); ++v)
        for (int u = x; u < std::min(x + 4, width); ++u) p.at(u, v) = grey;
    }
  return p;
}

/// The brief drive as a rig with a bonnet and dirt in its pictures sees it.
class DirtyDrive {
 public:
  DirtyDrive() : drive_(brief_drive()) {
    const Intrinsics& c = drive_.rig.intrinsics[0];
    // Identical paint in both images matches at infinity.
    const Image dirt = paint(c.width, c.height);
    for (std::size_t k = 0; k < 2; ++k) {
      for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x)
          masks_[k].at(x, y) = is_painted(k, x, y, c.height) ? 0 : 255;
    }
    for (std::size_t i = 0; i < kFrames; ++i) {
      pairs_.push_back(drive_.pairs[i]);
      for (std::size_t k = 0; k < 2; ++k) {
        std::vector<std::uint8_t>& bytes = pairs_.back()[k].bytes;
        for (std::size_t b = 0; b < bytes.size(); ++b)
          if (masks_[k].bytes[b] == 0) bytes[b] = dirt.bytes[b];
      }
    }
  }
  [[nodiscard]] std::array<ImageView, 2> masks() const {
    return {masks_[0].view(), masks_[1].view()};
  }
  [[nodiscard]] RigFrame frame(std::size_t i, bool dirty) const {
    RigFrame f = drive_.frame(i);
    for (std::size_t k = 0; dirty && k < 2; ++k) f.images[k] = pairs_[i][k].view();
    return f;
  }
  [[nodiscard]] const StereoDrive& drive() const { return drive_; }

 private:
  const StereoDrive& drive_;
  std::array<Image, 2> masks_{Image(640, 480), Image(640, 480)};
  std::vector<std::array<Image, 2>> pairs_;
};

const DirtyDrive& dirty_drive() {
  static const DirtyDrive drive;
  return drive;
}

struct Passed {
  /// Observations by camera, and those of them on painted pixels.
  std::array<int, 2> observations{}, painted{};
  int posed = 0;
  Transform T_left_world{};
  /// Error in m of the motion from the first frame to the last.
  double error = 0;
};

Passed pass(bool dirty, std::span<const ImageView> masks) {
  const DirtyDrive& d = dirty_drive();
  const StereoDrive& truth = d.drive();
  OdometryOptions options;
  Arena arena;
  SequentialRunner runner;
  odometry::Odometry odometry(options, truth.rig, true, arena, runner, masks);
  Passed passed;
  for (std::size_t i = 0; i < kFrames; ++i) {
    const odometry::FrameOutcome out = odometry.process(d.frame(i, dirty));
    if (out.posed) ++passed.posed;
    passed.T_left_world = out.T_left_world;
    for (const odometry::MapPoint& p : odometry.map().points())
      for (int k = 0; p.followed() && k < 2; ++k) {
        if (!p.now.by(k)) continue;
        const auto c = static_cast<std::size_t>(k);
        const int x = static_cast<int>(std::lround(p.raw[c].x())),
                  y = static_cast<int>(std::lround(p.raw[c].y()));
        ++passed.observations[c];
        passed.painted[c] += is_painted(c, x, y, truth.rig.intrinsics[0].height) ? 1 : 0;
      }
  }
  const Transform truly = truth.truth[kFrames - 1].inverse() * truth.truth[0];
  passed.error = ((truly.inverse() * passed.T_left_world).t).norm();
  return passed;
}

TEST(MaskedOdometry, usesNothingUnderMaskAndStaysAccurate) {
  const double way =
      (dirty_drive().drive().truth[kFrames - 1].t - dirty_drive().drive().truth[0].t).norm();
  ASSERT_GT(way, 15.0);
  const Passed clean = pass(false, {});
  const auto masks = dirty_drive().masks();
  const Passed masked = pass(true, masks);
  const Passed bare = pass(true, {});
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(masked.painted[k], 0) << "camera " << k;
    EXPECT_GT(masked.observations[k], static_cast<int>(kFrames) * 100) << "camera " << k;
    // Without the mask the paint is tracked.
    EXPECT_GT(bare.painted[k], static_cast<int>(kFrames)) << "camera " << k;
  }
  EXPECT_EQ(masked.posed, static_cast<int>(kFrames));
  // As in accuracy_test.cpp for clean images: 4 per mille of the path, and the first metre's
  // share of a keyframe.
  EXPECT_LT(clean.error, 0.004 * way + 0.02);
  EXPECT_LT(masked.error, 0.004 * way + 0.02);
}

}  // namespace
}  // namespace vergence::test
