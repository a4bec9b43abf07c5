// A camera that gave an image twice may be an exposure behind from then on.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/estimator/estimator.hpp"
#include "tests/unit/core/odometry/corridor.hpp"

namespace vergence {
namespace {

using features::test::copy_of;
using features::test::Image;
using odometry::test::Corridor;

/// A rig that drives, stands, and drives off again. While it stands the right camera gives an image
/// twice; with `late` it is one frame behind from then on.
struct StopAndGo {
  static constexpr int kStop = 70, kRepeat = 76, kGo = 96, kFrames = 156;
  // Each step is 2.5 mm more than the last one; 10 mm are three sigmas of a motion here.
  static constexpr int kMoves = kGo + 4;
  static constexpr double kSpeed = 0.7;         // steps a frame, of 0.15 m and 50 ms: 2 m/s
  static constexpr double kGathers = 0.05 / 3;  // of it a frame: 1 m/s²

  Corridor corridor;
  EstimatorOptions options;
  RigCalibration given = corridor.rig();
  SequentialRunner runner;
  ImmediateRunner solver;

  StopAndGo() {
    options.calibration.intrinsics = calibration::IntrinsicsEstimation::fixed;
    given.sigma_noise[1] = {2e-4, 4e-4, 2e-4, 1e-5, 2e-3, 4e-3};
  }

  [[nodiscard]] static std::string reported(const PoseSample& s, const Estimator& estimator) {
    std::string line = std::to_string(s.frame) + ' ' + std::string(to_string(s.status)) + ' ' +
                       std::string(to_string(s.reason)) + '\n';
    for (const EstimatorEvent& e : estimator.events()) line += std::string(e.why) + '\n';
    return line;
  }

  /// Each frame's sample to `see`.
  template <class See>
  void drive(bool late, const See& see) {
    Arena arena;
    Estimator estimator(options, given, given, arena, runner, solver);
    Image before(320, 240);
    double speed = 0, place = 0;
    for (int i = 0; i < kFrames; ++i) {
      speed = i < kStop ? kSpeed : i < kGo ? 0.0 : std::min(kSpeed, speed + kGathers);
      place += speed;
      RigFrame frame = corridor.frame_at(i, place);
      Image now = copy_of(frame.images[1]);
      if (i == kRepeat || (late && i > kRepeat)) frame.images[1] = before.view();
      see(i, estimator.process(frame), estimator);
      std::swap(before, now);
    }
  }
};

TEST(LateCamera, repeatWhileStandingIsNotOkOnceMoving) {
  StopAndGo d;
  std::string story;
  int ok_standing = 0, suspected = 0;
  d.drive(true, [&](int i, const PoseSample& s, const Estimator& e) {
    story += StopAndGo::reported(s, e);
    if (i > StopAndGo::kRepeat && i < StopAndGo::kGo) ok_standing += s.status == PoseStatus::ok;
    if (i < StopAndGo::kMoves) return;
    EXPECT_NE(s.status, PoseStatus::ok) << i << '\n' << story;
    suspected += s.reason == Reason::image_repeated;
  });
  EXPECT_EQ(ok_standing, StopAndGo::kGo - StopAndGo::kRepeat - 1) << story;
  EXPECT_GT(suspected, 0) << story;
}

TEST(LateCamera, repeatedImageIsOkAfterTwelveFrames) {
  StopAndGo d;
  std::string story;
  int first_ok = -1, suspected = 0;
  d.drive(false, [&](int i, const PoseSample& s, const Estimator& e) {
    story += StopAndGo::reported(s, e);
    if (i < StopAndGo::kMoves) return;
    suspected += s.reason == Reason::image_repeated;
    if (s.status == PoseStatus::ok && first_ok < 0) first_ok = i;
  });
  EXPECT_GE(suspected, 12) << story;
  ASSERT_GT(first_ok, 0) << story;
}

}  // namespace
}  // namespace vergence
