#include <cmath>
#include <numbers>

#include "drivers/sync/clock_mapper.hpp"
#include "tests/unit/drivers/mock/mock_bench.hpp"

namespace vergence::mock {
namespace {

MockBench drive_with(const std::vector<std::string>& faults, double seconds = 3) {
  MockBench b(faults, {.duration = Duration::seconds(seconds)});
  b.drive();
  return b;
}

TEST(MockRig, arrivalsKeepDelaysAndStampsTheirClock) {
  const MockBench h = drive_with({});
  const DeviceTiming timing = h.rig->camera(1).timing();
  ClockMapper mapper({timing.min_delay, timing.delay_spread, timing.resolution});
  for (std::size_t i = 0; i < h.frames[1].size(); ++i) {
    const Frame& f = h.frames[1][i].frame;
    const HostStamp truth =
        h.rig->start() + Duration::milliseconds(50) * static_cast<std::int64_t>(i);
    EXPECT_GE(f.arrival, truth + timing.min_delay);
    EXPECT_LE(f.arrival, truth + timing.min_delay + timing.delay_spread);
    const MappedStamp m = mapper.map(f.exposure_start, f.arrival);
    EXPECT_LE(std::abs((m.host - truth).ns()), m.error.ns());
  }
}

// Frames of 0.8 s on would arrive after the camera is disconnected: none of them does, and no event
// of its return is taken for a frame.
TEST(MockRig, framesInTransitAreLostWithTheCamera) {
  const MockBench h = drive_with(
      {"late_frames@0.5 camera=1 duration_s=0.5 share=1", "camera_gone@1 camera=1 duration_s=0.5"});
  EXPECT_EQ(h.disconnects[1], 1);
  EXPECT_GE(h.statistics[1].lost, 3U);
  EXPECT_EQ(h.frames[1].size() + h.statistics[1].lost, 51U);
  std::size_t starts = 0;
  for (const Seen& seen : h.frames[1]) {
    EXPECT_EQ(seen.frame.exposure, Duration::milliseconds(8));
    starts += seen.frame.counter == 0 ? 1 : 0;
  }
  EXPECT_EQ(starts, 2U);
}

TEST(MockRig, lostLateAndDuplicateFramesAreCounted) {
  const MockBench lost = drive_with({"lose_frames@0 camera=0 share=0.3 duration_s=0"});
  EXPECT_GT(lost.statistics[0].lost, 5U);
  EXPECT_EQ(lost.frames[0].size() + lost.statistics[0].lost, 61U);
  EXPECT_EQ(lost.frames[1].size(), 61U);

  const MockBench doubled = drive_with({"duplicate_frames@0 camera=0 share=1 duration_s=1"});
  EXPECT_EQ(doubled.frames[0].size(), 81U);

  const MockBench late = drive_with({"late_frames@1 camera=0 share=1 delay_s=0.3 duration_s=0.1"});
  ASSERT_EQ(late.frames[0].size(), 61U);
  std::vector<std::uint64_t> order;
  for (const Seen& s : late.frames[0]) order.push_back(s.frame.counter);
  EXPECT_FALSE(std::is_sorted(order.begin(), order.end()));
}

TEST(MockRig, brokenPairLosesOneRandomImage) {
  const MockBench h = drive_with({"break_pairs@0 duration_s=0"});
  EXPECT_EQ(h.frames[0].size() + h.frames[1].size(), 61U);
  EXPECT_GT(h.frames[0].size(), 15U);
  EXPECT_GT(h.frames[1].size(), 15U);
  for (const Seen& left : h.frames[0])
    for (const Seen& right : h.frames[1]) EXPECT_NE(left.frame.counter, right.frame.counter);
}

TEST(MockRig, missedTriggerIsNotExposedOrCounted) {
  const MockBench good = drive_with({}), h = drive_with({"missed_trigger@0.98 camera=1 pulses=2"});
  EXPECT_EQ(h.frames[0].size(), 61U);
  ASSERT_EQ(h.frames[1].size(), 59U);
  EXPECT_EQ(h.statistics[1].lost, 0U);
  for (std::size_t i = 0; i < 59; ++i) {
    const std::size_t pulse = i < 20 ? i : i + 2;
    EXPECT_EQ(h.frames[1][i].frame.counter, i);
    EXPECT_EQ(h.frames[1][i].frame.exposure_start, good.frames[1][pulse].frame.exposure_start);
    EXPECT_EQ(h.frames[1][i].mean, good.frames[1][pulse].mean);
  }
}

TEST(MockRig, laggingCameraSendsThePreviousImage) {
  const MockBench good = drive_with({}, 6),
                  lagging = drive_with({"lag@4 camera=1 duration_s=1"}, 6);
  ASSERT_EQ(lagging.frames[1].size(), good.frames[1].size());
  for (std::size_t i = 1; i < good.frames[1].size(); ++i) {
    const bool late = i >= 80 && i < 100;
    EXPECT_EQ(lagging.frames[1][i].mean, good.frames[1][late ? i - 1 : i].mean) << i;
    EXPECT_EQ(lagging.frames[1][i].frame.counter, i);
    EXPECT_EQ(lagging.frames[1][i].frame.exposure_start, good.frames[1][i].frame.exposure_start);
    EXPECT_EQ(lagging.frames[0][i].mean, good.frames[0][i].mean);
  }
  EXPECT_NE(good.frames[1][90].mean, good.frames[1][89].mean) << "the vehicle moves by then";
}

TEST(MockRig, swappedCablesExchangeTheImagesOnly) {
  const MockBench good = drive_with({}),
                  swapped = drive_with({"swap_cables@1", "cover@2 camera=0 duration_s=0.5"});
  for (std::size_t i = 0; i < 61; ++i) {
    const bool exchanged = i >= 20, covered = i >= 40 && i < 50;
    EXPECT_EQ(swapped.frames[0][i].mean, good.frames[exchanged ? 1 : 0][i].mean) << i;
    // Camera 0's lens is covered, and its image comes through the other cable.
    if (covered)
      EXPECT_LT(swapped.frames[1][i].mean, 1) << i;
    else
      EXPECT_EQ(swapped.frames[1][i].mean, good.frames[exchanged ? 0 : 1][i].mean) << i;
    EXPECT_EQ(swapped.frames[0][i].frame.exposure_start, good.frames[0][i].frame.exposure_start);
  }
}

TEST(MockRig, knockMovesTheTrueRigByItsParameters) {
  const auto truth = test::small_truth({"knock@1 camera=1 pitch_deg=0.2 x_m=0.003"});
  const RigCalibration before = truth->calibration(Duration::seconds(0.9)),
                       after = truth->calibration(Duration::seconds(1.1));
  EXPECT_TRUE(before.T_camera_left[1].R.isApprox(Mat3::Identity(), 1e-14));
  const Vec3 turned = log_so3(after.T_camera_left[1].R * before.T_camera_left[1].R.transpose());
  EXPECT_NEAR(turned.x(), 0.2 * std::numbers::pi / 180, 1e-12);
  EXPECT_LT(turned.tail<2>().norm(), 1e-12);
  EXPECT_NEAR(after.T_camera_left[1].t.x(), -0.747, 1e-12);
  // The left camera is where it was, and what the right one sees has moved.
  const Duration t = Duration::seconds(2);
  EXPECT_TRUE(truth->camera_on_body(0, t).t.isApprox(default_T_body_left().t, 1e-14));
}

}  // namespace
}  // namespace vergence::mock
