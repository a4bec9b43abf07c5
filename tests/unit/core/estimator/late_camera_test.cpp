// A camera that gave an image twice may be an exposure behind from then on.
#include <gtest/gtest.h>

#include <span>
#include <utility>

#include "tests/unit/core/estimator/corridor_drive.hpp"

namespace vergence {
namespace {

using namespace features::test;

/// A rig that drives, stands, and drives off again. While it stands the right camera gives an image
/// twice; with `late` it is one frame behind from then on.
struct StopAndGo : test::CorridorDrive {
  static constexpr int kStop = 70, kRepeat = 76, kGo = 96, kFrames = 156;
  // Each step is 2.5 mm more than the last one; 10 mm are three sigmas of a motion here.
  static constexpr int kMoves = kGo + 4;
  // Speed in steps of 0.15 m per frame of 50 ms, which is 2 m/s.
  static constexpr double kSpeed = 0.7;
  // Acceleration in steps per frame, which is 1 m/s².
  static constexpr double kGathers = 0.05 / 3;

  StopAndGo() {
    options.calibration.intrinsics = calibration::IntrinsicsEstimation::fixed;
    nominal = given;
  }

  void drive(bool late) {
    begin();
    Image before(320, 240);
    double speed = 0, place = 0;
    for (int i = 0; i < kFrames; ++i) {
      speed = i < kStop ? kSpeed : i < kGo ? 0.0 : std::min(kSpeed, speed + kGathers);
      place += speed;
      RigFrame frame = corridor.frame_at(i, place);
      Image now = copy_of(frame.images[1]);
      if (i == kRepeat || (late && i > kRepeat)) frame.images[1] = before.view();
      give(frame);
      std::swap(before, now);
    }
  }
};

TEST(LateCamera, repeatWhileStandingIsNotOkOnceMoving) {
  StopAndGo d;
  d.drive(true);
  int ok_standing = 0, suspected = 0;
  for (int i = StopAndGo::kRepeat + 1; i < StopAndGo::kFrames; ++i) {
    const PoseSample& s = d.samples[static_cast<std::size_t>(i)];
    if (i < StopAndGo::kGo) ok_standing += s.status == PoseStatus::ok;
    if (i < StopAndGo::kMoves) continue;
    EXPECT_NE(s.status, PoseStatus::ok) << i << '\n' << d.story;
    suspected += s.reason == Reason::image_repeated;
  }
  EXPECT_EQ(ok_standing, StopAndGo::kGo - StopAndGo::kRepeat - 1) << d.story;
  EXPECT_GT(suspected, 0) << d.story;
}

TEST(LateCamera, repeatedImageIsOkAfterTwelveFrames) {
  StopAndGo d;
  d.drive(false);
  const auto moving = std::span(d.samples).subspan(StopAndGo::kMoves);
  EXPECT_GE(std::count_if(moving.begin(), moving.end(),
                          [](const PoseSample& s) { return s.reason == Reason::image_repeated; }),
            12)
      << d.story;
  EXPECT_TRUE(std::any_of(moving.begin(), moving.end(), [](const PoseSample& s) {
    return s.status == PoseStatus::ok;
  })) << d.story;
}

}  // namespace
}  // namespace vergence
