#include "core/estimator/degradations.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "tests/unit/core/estimator/corridor_drive.hpp"

namespace vergence {
namespace {

TEST(DegradationLedger, strongestIsReported) {
  DegradationLedger ledger;
  EXPECT_EQ(ledger.strongest(true), nullptr);
  ledger.enter(Degradation::window, Reason::time_gap, 3);
  ledger.enter(Degradation::rig, Reason::recalibrating);
  ASSERT_NE(ledger.strongest(true), nullptr);
  EXPECT_EQ(ledger.strongest(true)->reason, Reason::recalibrating);
  EXPECT_TRUE(ledger.any_up_to(Degradation::rig));
  ledger.clear(Degradation::rig);
  EXPECT_EQ(ledger.strongest(true)->reason, Reason::time_gap);
  EXPECT_FALSE(ledger.any_up_to(Degradation::rig));
}

TEST(DegradationLedger, entryEndsAfterItsEvidence) {
  DegradationLedger ledger;
  EXPECT_FALSE(ledger.weaken(Degradation::scene));
  ledger.enter(Degradation::scene, Reason::map_reset, 2);
  EXPECT_FALSE(ledger.weaken(Degradation::scene));
  EXPECT_TRUE(ledger.weaken(Degradation::scene));
  EXPECT_FALSE(ledger.active(Degradation::scene));
  ledger.enter(Degradation::rig, Reason::recalibrating);
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(ledger.weaken(Degradation::rig));
  EXPECT_TRUE(ledger.active(Degradation::rig));
}

// A camera that gives the same image again and again while the rig drives on.

using namespace features::test;
using odometry::test::Corridor;

/// Camera `frozen` gives its image of frame 30 until frame 46: 0.8 s, 2.4 m.
class RepeatedImage : public testing::TestWithParam<std::size_t> {};

TEST_P(RepeatedImage, repeatedImageIsNotTakenForStandstill) {
  constexpr int kFrozen = 30, kGoesOn = 47, kLast = 60;
  test::CorridorDrive d;
  d.options.online = false;
  d.given = d.nominal = d.corridor.rig();
  d.begin();
  std::optional<Image> kept;
  int posed = 0;
  for (int i = 0; i < kLast; ++i) {
    RigFrame frame = d.corridor.frame(i);
    ImageView& image = frame.images[GetParam()];
    if (i == kFrozen) kept = copy_of(image);
    const bool repeated = i > kFrozen && i < kGoesOn;
    if (repeated) image = kept->view();
    const PoseSample s = d.give(frame);
    if (repeated) {
      EXPECT_NE(s.status, PoseStatus::ok) << i;
      EXPECT_EQ(s.reason, Reason::image_repeated) << i;
    }
    if (s.status == PoseStatus::lost) continue;
    ++posed;
    const Transform truth = Corridor::T_world_left(0).inverse() * Corridor::T_world_left(i);
    const double off = (s.T_world_left.t - truth.t).norm();
    const auto variance = [&](std::size_t at) { return static_cast<double>(s.covariance[at]); };
    const double sigma = std::sqrt(variance(0) + variance(6) + variance(11));
    EXPECT_LE(off, 4 * sigma) << i << ' ' << to_string(s.reason);
    // The left camera goes on by itself as both did together: odometry_unlinked_test derives it.
    if (GetParam() == 1) {
      EXPECT_LT(off, 0.025 + 0.01 * truth.t.norm()) << i;
    }
  }
  // The first new image after 2.4 m without images may have to be found again in the next one.
  EXPECT_GE(posed, kLast - 1);
}

INSTANTIATE_TEST_SUITE_P(OfEitherCamera, RepeatedImage, testing::Values(0U, 1U));

// A camera that gave an image twice may be an exposure behind from then on.

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
