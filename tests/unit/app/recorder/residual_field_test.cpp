#include "app/recorder/residual_field.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/camera/camera.hpp"
#include "core/math/random.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

constexpr std::uint64_t kAll = std::numeric_limits<std::uint64_t>::max();

RigCalibration rig_of_two() {
  RigCalibration rig;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k] = {.width = 640,
                         .height = 480,
                         .fx = 500,
                         .fy = 500,
                         .cx = 320,
                         .cy = 240,
                         .distortion = {-0.1, 0.02, 0, 0, 0}};
  rig.T_camera_left[1] = {exp_so3({0.002, 0.003, -0.001}), {-0.5, 0.01, 0.02}};
  return rig;
}

/// Points all over both images as this rig sees them, without noise.
std::vector<RawMatch> matches_of(const RigCalibration& rig, int count) {
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[1]);
  Random random(3);
  std::vector<RawMatch> matches;
  while (static_cast<int>(matches.size()) < count) {
    const Vec2 at(639 * random.uniform(), 479 * random.uniform());
    Vec3 ray;
    Vec2 other;
    if (!left.unproject(at, &ray) ||
        right.project(rig.T_camera_left[1] * (ray * (10 + 40 * random.uniform())), &other,
                      nullptr) != ProjectStatus::ok)
      continue;
    RawMatch m;
    m.left = {static_cast<float>(at.x()), static_cast<float>(at.y())};
    m.other = {static_cast<float>(other.x()), static_cast<float>(other.y())};
    m.frame = matches.size();
    matches.push_back(m);
  }
  return matches;
}

TEST(ResidualField, ofTheTrueRigIsZeroEverywhere) {
  const RigCalibration rig = rig_of_two();
  const auto cells = residual_field(matches_of(rig, 4000), rig, 0, kAll);
  ASSERT_EQ(cells.size(), 48U);
  int count = 0;
  for (const ResidualCell& c : cells) {
    EXPECT_LT(std::abs(c.mean_px), 1e-4) << c.left << " " << c.top;
    count += c.matches;
  }
  EXPECT_EQ(count, 4000);
}

TEST(ResidualField, aPitchMovesTheLinesByTheFocalLengthTimesItAndDownIsPositive) {
  const RigCalibration truth = rig_of_two();
  const auto matches = matches_of(truth, 4000);
  RigCalibration claimed = truth;  // X_claimed = Exp(−φ) X: y/z grows by φ, so lines lie too far
                                   // down and points above them
  claimed.T_camera_left[1].R = exp_so3({-0.001, 0, 0}) * claimed.T_camera_left[1].R;
  for (const ResidualCell& c : residual_field(matches, claimed, 0, kAll)) {
    EXPECT_LT(c.mean_px, -0.4) << "px; 0.5 in the middle";
    EXPECT_GT(c.mean_px, -0.8);
  }
}

TEST(ResidualField, wrongMatchesAndCellsWithHardlyAnyAreLeftOut) {
  const RigCalibration rig = rig_of_two();
  auto matches = matches_of(rig, 4000);
  for (std::size_t i = 0; i < matches.size(); i += 10) matches[i].other[1] += 30;
  for (RawMatch& m : matches)
    if (m.left[0] < 80 && m.left[1] < 80) m.camera = 2;  // of a camera that the rig does not have
  const auto cells = residual_field(matches, rig, 0, kAll);
  EXPECT_EQ(cells.size(), 47U);
  for (const ResidualCell& c : cells) EXPECT_LT(std::abs(c.mean_px), 1e-4);
}

TEST(ResidualField, onlyFramesOfTheSameRigCount) {
  const RigCalibration rig = rig_of_two();
  const auto matches = matches_of(rig, 4000);
  int count = 0;
  for (const ResidualCell& c : residual_field(matches, rig, 1000, 3000)) count += c.matches;
  EXPECT_EQ(count, 2000);
  EXPECT_TRUE(residual_field(matches, rig, 0, 0).empty());
}

}  // namespace
}  // namespace vergence::app
