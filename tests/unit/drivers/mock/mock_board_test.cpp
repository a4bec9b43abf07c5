#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/mock/mock_rig.hpp"
#include "firmware_iface/trigger/trigger.h"
#include "tests/support/small_mock.hpp"

namespace vergence::mock {
namespace {

constexpr Duration kExposure = Duration::milliseconds(8);
constexpr Duration kPeriod = Duration::milliseconds(50);

TriggerConfiguration at_20_hz() {
  TriggerConfiguration c;
  c.rate_hz = 20;
  return c;
}

/// Tiny pictures of an almost empty town, and everything that the board, the cameras and the host
/// see of a drive.
struct Bench {
  explicit Bench(const std::vector<std::string>& faults, const TriggerConfiguration& c,
                 double seconds = 4, bool reports_taken = true,
                 std::array<Duration, kMaxCameras> delays = {}) {
    MockRigOptions o;
    o.duration = Duration::seconds(seconds);
    o.reports_taken = reports_taken;
    o.trigger_delay = delays;
    rig = std::make_unique<MockRig>(test::small_truth(faults), o);
    for (int k = 0; k < 2; ++k)
      EXPECT_EQ(rig->camera(k).configure(test::small_camera(), nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig->trigger().configure(c, nullptr), DeviceStatus::ok);
  }

  /// `pause_at`: asks for a pause of five pulses when the report of that pulse is taken.
  void drive(std::optional<std::uint64_t> pause_at = {}) {
    for (int k = 0; k < 2; ++k) EXPECT_EQ(rig->camera(k).start(nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig->trigger().start(nullptr), DeviceStatus::ok);
    std::array<bool, 3> ended{};
    while (!(ended[0] && ended[1] && ended[2])) {
      for (std::size_t k = 0; k < 2; ++k) {
        CameraDevice& camera = rig->camera(static_cast<int>(k));
        Frame f;
        const DeviceStatus status = camera.wait(Duration{}, &f);
        if (status == DeviceStatus::ok) {
          frames[k].push_back(f);
          camera.release(f.slot);
        }
        const DeviceStatus again = status == DeviceStatus::gone ? camera.start(nullptr) : status;
        ended[k] = ended[k] || again == DeviceStatus::ended;
      }
      Pulse p;
      const DeviceStatus status = rig->trigger().wait(Duration::microseconds(50), &p);
      if (status == DeviceStatus::ok) pulses.push_back(p);
      if (status == DeviceStatus::ok && pause_at && p.number == *pause_at) {
        EXPECT_EQ(rig->trigger().pause(5), DeviceStatus::ok);
        EXPECT_EQ(rig->trigger().pause(5), DeviceStatus::ok) << "one is under way: nothing more";
      }
      if (status == DeviceStatus::gone) {
        if (!is_gone) {
          ++gone;
          EXPECT_EQ(rig->trigger().pause(5), DeviceStatus::gone);
        }
        const DeviceStatus again = rig->trigger().start(nullptr);
        is_gone = again != DeviceStatus::ok;
        ended[2] = ended[2] || again == DeviceStatus::ended;
      }
      ended[2] = ended[2] || status == DeviceStatus::ended;
    }
  }
  [[nodiscard]] Duration true_time(HostStamp host) const { return host - rig->start(); }

  std::unique_ptr<MockRig> rig;
  std::vector<Pulse> pulses;
  std::array<std::vector<Frame>, 2> frames;
  int gone = 0;
  bool is_gone = false;
};

TEST(MockBoard, variedIntervalsAreLongerAndShorterAsTheProtocolSays) {
  TriggerConfiguration c = at_20_hz();
  c.vary = Duration::milliseconds(2);
  Bench b({}, c);
  b.drive();
  const std::vector<Duration> times = b.rig->pulse_times();
  ASSERT_EQ(b.pulses.size(), times.size());
  ASSERT_EQ(b.frames[1].size(), times.size());
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const Duration requested =
        kPeriod + (trigger_interval_is_longer(static_cast<std::uint32_t>(i)) ? c.vary : -c.vary);
    EXPECT_EQ(times[i + 1] - times[i], requested);
    const Duration by_camera = b.frames[1][i + 1].exposure_start - b.frames[1][i].exposure_start;
    EXPECT_NEAR(static_cast<double>((by_camera - requested).ns()), 0, 3000)
        << "drift and whole microseconds";
  }
}

TEST(MockBoard, aPauseLeavesPulsesOutAtTheSamePlaceOnEveryRun) {
  for (int run = 0; run < 3; ++run) {
    Bench b({}, at_20_hz());
    b.drive(20);
    ASSERT_EQ(b.pulses.size(), 76U);
    EXPECT_EQ(b.pulses[23].number, 23U);
    EXPECT_EQ(b.pulses[24].number, 29U)
        << "from the fourth after the report at which it was asked for, numbers too";
    EXPECT_TRUE(b.pulses[24].resumed);
    for (const auto& frames : b.frames) {
      ASSERT_EQ(frames.size(), 76U);
      EXPECT_EQ(frames[24].counter, 24U) << "a camera counts what it exposed";
      EXPECT_NEAR((frames[24].exposure_start - frames[23].exposure_start).to_seconds(), 0.3, 1e-4);
    }
  }
}

TEST(MockBoard, feedbackTellsEveryExposureAndThatOneNeverCame) {
  TriggerConfiguration c = at_20_hz();
  c.feedback = 0b11;
  Bench b({"missed_trigger@1 camera=1 pulses=2", "camera_gone@2 camera=0 duration_s=0.5"}, c, 4,
          true, {Duration::microseconds(20), Duration::microseconds(35)});
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
    const Duration told = b.true_time(p.arrival) - b.rig->pulse_times()[p.number];
    EXPECT_GT(told, kExposure);
    if (left && right) {
      EXPECT_LT(told, kExposure + Duration::milliseconds(4));
    }
    EXPECT_LT(told, kPeriod + Duration::milliseconds(3));
  }
}

TEST(MockBoard, aRebootedBoardCountsAndTicksFromZeroWithAnotherBoot) {
  Bench b({"board_reboot@2 duration_s=0.5"}, at_20_hz());
  b.drive();
  ASSERT_EQ(b.pulses.size(), 40U + 31U);
  EXPECT_EQ(b.pulses[39].number, 39U);
  EXPECT_EQ(b.pulses[40].number, 0U);
  EXPECT_NE(b.pulses[40].boot, b.pulses[39].boot);
  EXPECT_TRUE(b.pulses[40].resumed);
  EXPECT_EQ(b.pulses[40].edge.ns(), 0);
  EXPECT_EQ(b.true_time(b.rig->start() + b.rig->pulse_times()[40]), Duration::seconds(2.5));
  EXPECT_EQ(b.frames[0].size(), 71U) << "no pulse, no exposure";
  EXPECT_EQ(b.frames[0].back().counter, 70U) << "the cameras know nothing of it";
  EXPECT_EQ(b.gone, 0);
  EXPECT_EQ(b.rig->trigger().statistics().reboots, 1U);
}

TEST(MockBoard, anUnpluggedBoardStopsWithItsLineUnlessItHasASupplyOfItsOwn) {
  Bench bare({"board_gone@2 duration_s=0.5"}, at_20_hz());
  bare.drive();
  EXPECT_EQ(bare.gone, 1);
  EXPECT_EQ(bare.frames[0].size(), 71U);
  ASSERT_EQ(bare.pulses.size(), 71U);
  EXPECT_EQ(bare.pulses[40].number, 0U);
  EXPECT_EQ(bare.rig->trigger().statistics().starts, 2U);

  Bench powered({"board_gone@2 duration_s=0.5 powered=1"}, at_20_hz());
  powered.drive();
  EXPECT_EQ(powered.gone, 1);
  EXPECT_EQ(powered.frames[0].size(), 81U) << "pulses nobody heard of";
  ASSERT_EQ(powered.pulses.size(), 71U);
  EXPECT_EQ(powered.pulses[40].number, 50U);
  EXPECT_EQ(powered.pulses[40].boot, powered.pulses[39].boot);
  EXPECT_EQ(powered.rig->trigger().statistics().lost, 10U);
}

}  // namespace
}  // namespace vergence::mock
