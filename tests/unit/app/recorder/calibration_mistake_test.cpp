#include "app/recorder/calibration_mistake.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/camera/camera.hpp"
#include "core/math/random.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

constexpr std::uint64_t kAll = std::numeric_limits<std::uint64_t>::max();

RigCalibration rig_of_two(double k1) {
  RigCalibration rig;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k] = {.width = 640,
                         .height = 480,
                         .fx = 500,
                         .fy = 500,
                         .cx = 320,
                         .cy = 240,
                         .distortion = {k1, 0, 0, 0, 0}};
  rig.T_camera_left[1] = {exp_so3({0.01, 0.003, -0.004}), {-0.5, 0.01, 0.02}};
  return rig;
}

/// Points over both images as this rig sees them, each 0.2 px off.
std::vector<RawMatch> matches_of(const RigCalibration& rig, std::size_t count) {
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[1]);
  Random random(3);
  std::vector<RawMatch> matches;
  while (matches.size() < count) {
    const Vec2 at(639 * random.uniform(), 479 * random.uniform());
    Vec3 ray;
    Vec2 other;
    if (!left.unproject(at, &ray) ||
        right.project(rig.T_camera_left[1] * (ray * (5 + 40 * random.uniform())), &other,
                      nullptr) != ProjectStatus::ok)
      continue;
    RawMatch m;
    m.left = {static_cast<float>(at.x()), static_cast<float>(at.y())};
    m.other = {static_cast<float>(other.x()),
               static_cast<float>(other.y() + (matches.size() % 2 == 0 ? 0.2 : -0.2))};
    m.frame = matches.size();
    matches.push_back(m);
  }
  return matches;
}

TEST(CalibrationMistake, theTrueRigHasNone) {
  const RigCalibration rig = rig_of_two(-0.3);
  EXPECT_EQ(find_mistake(matches_of(rig, 2000), rig, kAll), CalibrationMistake::none);
}

TEST(CalibrationMistake, aRotationGivenTransposedIsTold) {
  const RigCalibration rig = rig_of_two(-0.3);
  RigCalibration given = rig;
  given.T_camera_left[1].R.transposeInPlace();
  EXPECT_EQ(find_mistake(matches_of(rig, 2000), given, kAll),
            CalibrationMistake::rotation_transposed);
  EXPECT_EQ(find_mistake(matches_of(rig, 2000), given, 100), CalibrationMistake::none)
      << "a hundred matches are few";
}

TEST(CalibrationMistake, distortionOfImagesThatAreRectifiedIsTold) {
  EXPECT_EQ(find_mistake(matches_of(rig_of_two(0), 2000), rig_of_two(-0.3), kAll),
            CalibrationMistake::already_rectified);
}

TEST(CalibrationMistake, aKnockIsNone) {
  const RigCalibration rig = rig_of_two(-0.3);
  RigCalibration knocked = rig;
  knocked.T_camera_left[1].R = exp_so3({0.006, 0, 0.01}) * rig.T_camera_left[1].R;
  EXPECT_EQ(find_mistake(matches_of(knocked, 2000), rig, kAll), CalibrationMistake::none);
}

}  // namespace
}  // namespace vergence::app
