#include "core/estimator/estimator.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "tests/support/parallel_rig.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence {
namespace {

using namespace features::test;

constexpr int kWidth = 320, kHeight = 240;
// Disparity in px.
constexpr double kDisparity = 12.0;

RigCalibration rig() {
  return test::parallel_rig(
      {.width = kWidth, .height = kHeight, .fx = 280, .fy = 280, .cx = 160, .cy = 120}, 0.5);
}

/// The calibration is taken as it is: a rig that stands could never confirm it.
EstimatorOptions believing() { return {.online = false}; }

/// A rig that stands before a wall 12 px of disparity away. Every frame has noise of its own, as a
/// sensor's would.
struct Standing {
  static constexpr int kImages = 4;
  RigCalibration calibration = rig();
  Texture texture{5};
  std::vector<Image> left, right;
  Image other_size = draw(kWidth / 2, kHeight, texture);
  EstimatorOptions options = believing();
  Arena arena;
  SequentialRunner runner;
  ImmediateRunner solver;
  Estimator estimator{options, calibration, calibration, arena, runner, solver};

  Standing() {
    Random random(8);
    for (int i = 0; i < kImages; ++i) {
      left.push_back(
          draw(kWidth, kHeight, [&](const Vec2& p) { return texture(p) + random.normal(); }));
      right.push_back(draw(kWidth, kHeight, [&](const Vec2& p) {
        return texture(p + Vec2(kDisparity, 0)) + random.normal();
      }));
    }
  }
  [[nodiscard]] RigFrame frame(int i) const {
    RigFrame f{.number = static_cast<std::uint64_t>(i),
               .stamp = Stamp(1'000'000'000 + 50'000'000LL * i),
               .cameras = 2};
    f.images[0] = left[static_cast<std::size_t>(i % kImages)].view();
    f.images[1] = right[static_cast<std::size_t>(i % kImages)].view();
    return f;
  }
  PoseSample give(int i) { return estimator.process(frame(i)); }
};

void expect_at_start(const PoseSample& s) {
  // One grey level of noise moves a corner by some 0.02 px, of 12 px of disparity at 11.7 m 2 cm;
  // of forty points less than 4 mm.
  EXPECT_LT(s.T_world_left.t.norm(), 0.02);
  EXPECT_LT(log_so3(s.T_world_left.R).norm(), 1e-3);
}

/// 1 σ of a pose's position, m.
double position_sigma(const PoseSample& s) {
  const auto variance = [&](std::size_t at) { return static_cast<double>(s.covariance[at]); };
  return std::sqrt(variance(0) + variance(6) + variance(11));
}

// Every frame is measured against the same map: the pose of the last is no worse than that of the
// tenth. Summed up frame by frame it would be √20 times.
TEST(Estimator, standingPoseKeepsItsUncertainty) {
  Standing s;
  double tenth = 0;
  for (int i = 0; i <= 200; ++i) {
    const PoseSample sample = s.give(i);
    if (i == 10) tenth = position_sigma(sample);
    if (i == 200) {
      EXPECT_GT(position_sigma(sample), 0);
      EXPECT_LT(position_sigma(sample), 3 * tenth);
    }
  }
}

TEST(Estimator, contradictedPairingUsesTheLeftImageOnly) {
  Standing contradicted, single_camera;
  for (int i = 0; i < 3; ++i) {
    (void)contradicted.give(i);
    (void)single_camera.give(i);
  }
  RigFrame frame = contradicted.frame(3);
  frame.pairing = Pairing::contradicted;
  const PoseSample sample = contradicted.estimator.process(frame);
  EXPECT_EQ(sample.status, PoseStatus::degraded);
  EXPECT_EQ(sample.reason, Reason::pairing_ambiguous);
  RigFrame left = single_camera.frame(3);
  left.images[1] = {};
  const PoseSample expected = single_camera.estimator.process(left);
  EXPECT_EQ(sample.T_world_left.t, expected.T_world_left.t) << "bit for bit";
  EXPECT_EQ(sample.stereo_inliers, 0);
  EXPECT_EQ(contradicted.give(4).status, PoseStatus::ok) << "that one frame only";
}

TEST(Estimator, olderFrameIsLostAndChangesNothing) {
  Standing s, undisturbed;
  for (int i = 0; i < 4; ++i) {
    (void)s.give(i);
    (void)undisturbed.give(i);
  }
  for (const int again : {3, 2, 0}) {
    const PoseSample sample = s.give(again);
    EXPECT_EQ(sample.status, PoseStatus::lost);
    EXPECT_EQ(sample.reason, Reason::time_gap);
    ASSERT_EQ(s.estimator.events().size(), 1U);
    EXPECT_EQ(s.estimator.events()[0].kind, EstimatorEvent::Kind::dropped);
  }
  const PoseSample a = s.give(4), b = undisturbed.give(4);
  EXPECT_EQ(a.status, PoseStatus::ok);
  EXPECT_EQ(a.T_world_left.t, b.T_world_left.t);
  EXPECT_EQ(a.T_world_left.R, b.T_world_left.R);
}

TEST(Estimator, missingImageIsDegradedAndRecovers) {
  for (const std::size_t camera : {0U, 1U}) {
    Standing s;
    for (int i = 0; i < 4; ++i) (void)s.give(i);
    for (int i = 4; i < 8; ++i) {
      RigFrame f = s.frame(i);
      f.images[camera] = {};
      const PoseSample sample = s.estimator.process(f);
      EXPECT_EQ(sample.status, PoseStatus::degraded);
      EXPECT_EQ(sample.reason, Reason::no_image);
      expect_at_start(sample);
    }
    const PoseSample after = s.give(8);
    EXPECT_EQ(after.status, PoseStatus::ok) << to_string(after.reason);
    expect_at_start(after);
  }
}

TEST(Estimator, frameWithoutImagesIsLostAndRecovers) {
  Standing s;
  for (int i = 0; i < 4; ++i) (void)s.give(i);
  for (int i = 4; i < 10; ++i) {
    RigFrame f = s.frame(i);
    f.images[0] = f.images[1] = {};
    const PoseSample sample = s.estimator.process(f);
    EXPECT_EQ(sample.status, PoseStatus::lost);
    EXPECT_EQ(sample.reason, Reason::no_image);
  }
  EXPECT_EQ(s.estimator.state(), State::lost);
  const PoseSample after = s.give(10);
  EXPECT_NE(after.status, PoseStatus::lost);
  EXPECT_EQ(s.estimator.state(), State::stereo_odometry);
  expect_at_start(after);
}

TEST(Estimator, imageOfAnotherSizeIsNotRead) {
  for (const std::size_t camera : {0U, 1U}) {
    Standing s;
    for (int i = 0; i < 4; ++i) (void)s.give(i);
    RigFrame f = s.frame(4);
    f.images[camera] = s.other_size.view();
    const PoseSample sample = s.estimator.process(f);
    EXPECT_EQ(sample.status, PoseStatus::degraded);
    expect_at_start(sample);
    f = s.frame(5);
    f.images[0] = f.images[1] = s.other_size.view();
    EXPECT_EQ(s.estimator.process(f).status, PoseStatus::lost);
    const PoseSample after = s.give(6);
    EXPECT_EQ(after.status, PoseStatus::ok) << to_string(after.reason);
  }
}

TEST(Estimator, invalidRigIsRefused) {
  const auto begin = [](const RigCalibration& r) {
    Arena arena;
    SequentialRunner runner;
    ImmediateRunner solver;
    const Estimator estimator({}, r, r, arena, runner, solver);
  };
  RigCalibration one = rig(), small = rig(), no_focus = rig(), no_baseline = rig(),
                 not_a_number = rig();
  one.cameras = 1;
  small.intrinsics[1].height = 40;
  no_focus.intrinsics[0].fx = 0;
  no_baseline.T_camera_left[1].t.setZero();
  not_a_number.T_camera_left[1].t.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NO_THROW(begin(rig()));
  for (const RigCalibration& r : {one, small, no_focus, no_baseline, not_a_number})
    EXPECT_THROW(begin(r), std::invalid_argument);
}

}  // namespace
}  // namespace vergence
