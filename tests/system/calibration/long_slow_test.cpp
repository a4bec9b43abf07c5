// Statistics over many drives, and what lasts: minutes of rendering each.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/system/calibration/test_trajectory.hpp"

namespace vergence::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(LongSlow, aPitchThatCreepsIsNoticedAndFollowed) {
  RenderedDriveOptions options;
  const Transform T = options.rig.T_camera_left[1];
  const double rate = 0.02 * kDegree / 60;  // rad/s
  const auto crept = [&](std::uint64_t i) { return rate * static_cast<double>(i) / options.rate; };
  options.placed = [&](int, std::uint64_t i) {
    return perturbed(T, {crept(i), 0, 0}, Vec3::Zero());
  };
  options.from_s = 8;
  RenderedDrive drive(options);
  Course course(with_calibration(options.rig));
  const auto frames = static_cast<std::uint64_t>(0.03 * kDegree / rate * options.rate);
  std::uint64_t i = 0;
  for (; i < frames && course.first(EstimatorEvent::Kind::rig_changed) == nullptr; ++i)
    course.give(drive.frame(i), drive.T_enu_left(i));
  const TimedEvent* noticed = course.first(EstimatorEvent::Kind::rig_changed);
  ASSERT_NE(noticed, nullptr) << course.story();
  std::printf("noticed at %.4f deg\n", crept(noticed->frame) / kDegree);
  for (const std::uint64_t end = i + 120; i < end && course.accepted() == nullptr; ++i)
    course.give(drive.frame(i), drive.T_enu_left(i));
  ASSERT_NE(course.accepted(), nullptr) << course.story();
  const RigError e = rig_error(course.accepted()->calibration, 1, options.placed(1, i));
  std::printf("%s\n", to_string(e).c_str());
  EXPECT_LT(e.rotation, 0.25e-3) << to_string(e);
}

}  // namespace
}  // namespace vergence::test
