#include "firmware_iface/trigger/trigger.h"
#include "tests/unit/drivers/mock/mock_bench.hpp"

namespace vergence::mock {
namespace {

constexpr Duration kExposure = Duration::milliseconds(8);
constexpr Duration kPeriod = Duration::milliseconds(50);

MockRigOptions four_seconds() { return {.duration = Duration::seconds(4)}; }

TEST(MockBoard, variedIntervalsFollowTheProtocol) {
  TriggerConfiguration c{kRate};
  c.vary = Duration::milliseconds(2);
  MockBench b({}, four_seconds(), c);
  b.drive();
  const std::vector<Duration> times = b.rig->pulse_times();
  ASSERT_EQ(b.pulses.size(), times.size());
  ASSERT_EQ(b.frames[1].size(), times.size());
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const Duration requested =
        kPeriod + (trigger_interval_is_longer(static_cast<std::uint32_t>(i)) ? c.vary : -c.vary);
    EXPECT_EQ(times[i + 1] - times[i], requested);
    const Duration by_camera =
        b.frames[1][i + 1].frame.exposure_start - b.frames[1][i].frame.exposure_start;
    EXPECT_NEAR(static_cast<double>((by_camera - requested).ns()), 0, 3000)
        << "drift and whole microseconds";
  }
}

TEST(MockBoard, pauseOmitsTheSamePulsesOnEveryRun) {
  for (int run = 0; run < 3; ++run) {
    MockBench b({}, four_seconds());
    b.drive(20);
    ASSERT_EQ(b.pulses.size(), 76U);
    EXPECT_EQ(b.pulses[23].number, 23U);
    EXPECT_EQ(b.pulses[24].number, 29U)
        << "from the fourth after the report at which it was asked for, numbers too";
    EXPECT_TRUE(b.pulses[24].resumed);
    for (const auto& frames : b.frames) {
      ASSERT_EQ(frames.size(), 76U);
      EXPECT_EQ(frames[24].frame.counter, 24U) << "a camera counts what it exposed";
      EXPECT_NEAR((frames[24].frame.exposure_start - frames[23].frame.exposure_start).to_seconds(),
                  0.3, 1e-4);
    }
  }
}

TEST(MockBoard, feedbackReportsExposuresAndMissedTriggers) {
  TriggerConfiguration c{kRate};
  c.feedback = 0b11;
  MockRigOptions o = four_seconds();
  o.trigger_delay = {Duration::microseconds(20), Duration::microseconds(35)};
  MockBench b({"missed_trigger@1 camera=1 pulses=2", "camera_gone@2 camera=0 duration_s=0.5"}, o,
              c);
  b.drive();
  ASSERT_EQ(b.pulses.size(), 81U);
  for (const Pulse& p : b.pulses) {
    const bool right = p.number < 20 || p.number >= 22, left = p.number < 40 || p.number >= 50;
    EXPECT_EQ(p.exposure[0].seen, left) << p.number;
    EXPECT_EQ(p.exposure[1].seen, right) << p.number;
    if (left) {
      EXPECT_EQ(p.exposure[0].start, Duration::microseconds(20));
    }
    if (right) {
      EXPECT_EQ(p.exposure[1].start, Duration::microseconds(35));
      EXPECT_EQ(p.exposure[1].end, Duration::microseconds(35) + kExposure);
    }
    const Duration reported = p.arrival - b.rig->start() - b.rig->pulse_times()[p.number];
    EXPECT_GT(reported, kExposure);
    if (left && right) {
      EXPECT_LT(reported, kExposure + Duration::milliseconds(4));
    }
    EXPECT_LT(reported, kPeriod + Duration::milliseconds(3));
  }
}

TEST(MockBoard, rebootRestartsNumbersAndTicksWithNewBoot) {
  MockBench b({"board_reboot@2 duration_s=0.5"}, four_seconds());
  b.drive();
  ASSERT_EQ(b.pulses.size(), 40U + 31U);
  EXPECT_EQ(b.pulses[39].number, 39U);
  EXPECT_EQ(b.pulses[40].number, 0U);
  EXPECT_NE(b.pulses[40].boot, b.pulses[39].boot);
  EXPECT_TRUE(b.pulses[40].resumed);
  EXPECT_EQ(b.pulses[40].edge.ns(), 0);
  EXPECT_EQ(b.rig->pulse_times()[40], Duration::seconds(2.5));
  EXPECT_EQ(b.frames[0].size(), 71U) << "no pulse, no exposure";
  EXPECT_EQ(b.frames[0].back().frame.counter, 70U) << "the cameras know nothing of it";
  EXPECT_EQ(b.board_disconnected, 0);
  EXPECT_EQ(b.rig->trigger().statistics().reboots, 1U);
}

TEST(MockBoard, unpluggedBoardStopsUnlessPowered) {
  MockBench bare({"board_gone@2 duration_s=0.5"}, four_seconds());
  bare.drive();
  EXPECT_EQ(bare.board_disconnected, 1);
  EXPECT_EQ(bare.frames[0].size(), 71U);
  ASSERT_EQ(bare.pulses.size(), 71U);
  EXPECT_EQ(bare.pulses[40].number, 0U);
  EXPECT_EQ(bare.rig->trigger().statistics().starts, 2U);

  MockBench powered({"board_gone@2 duration_s=0.5 powered=1"}, four_seconds());
  powered.drive();
  EXPECT_EQ(powered.board_disconnected, 1);
  EXPECT_EQ(powered.frames[0].size(), 81U) << "pulses nobody heard of";
  ASSERT_EQ(powered.pulses.size(), 71U);
  EXPECT_EQ(powered.pulses[40].number, 50U);
  EXPECT_EQ(powered.pulses[40].boot, powered.pulses[39].boot);
  EXPECT_EQ(powered.rig->trigger().statistics().lost, 10U);
}

}  // namespace
}  // namespace vergence::mock
