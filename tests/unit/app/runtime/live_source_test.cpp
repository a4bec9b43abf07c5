#include "app/runtime/live_source.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/memory/allocation_guard.hpp"
#include "drivers/mock/mock_rig.hpp"

namespace vergence::app {
namespace {

constexpr Stamp kStart{1'577'836'800'000'000'000};

/// A mock rig with tiny pictures in an almost empty town, and the source on top of it.
struct Bench {
  explicit Bench(const std::vector<std::string>& faults, bool real_time = false, Duration grid = Duration::nanoseconds(1)) {
    mock::WorldOptions town;
    town.texture_detail = 0;
    town.built_fraction = town.tree_fraction = town.car_fraction = 0;
    RigCalibration calibration;
    calibration.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) {
      Intrinsics& lens = calibration.intrinsics[k];
      lens.width = 64;
      lens.height = 48;
      lens.fx = lens.fy = 50;
      lens.cx = 31.5;
      lens.cy = 23.5;
    }
    calibration.T_camera_left[1].t = {-0.75, 0, 0};
    std::vector<mock::Fault> parsed;
    for (const std::string& f : faults) parsed.push_back(mock::parse_fault(f));
    mock::DriveOptions drive;
    drive.kind = mock::DriveKind::brief;
    mock::MockRigOptions o;
    o.duration = Duration::seconds(4);
    o.real_time = real_time;
    rig = std::make_unique<mock::MockRig>(
        std::make_shared<const mock::RigTruth>(std::make_shared<const mock::World>(town), drive, calibration, mock::default_T_body_left(),
                                               Transform{}, parsed),
        o);
    for (int k = 0; k < 2; ++k)
      EXPECT_EQ(rig->camera(k).configure({64, 48, 20, Duration::milliseconds(8), 0, CameraTrigger::hardware}, nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig->ins().configure(120, nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig->trigger().configure({20}, nullptr), DeviceStatus::ok);
    LiveSource::Options options;
    options.sync.interval = Duration::milliseconds(50);
    options.wait_when_full = !real_time;
    options.tie_stamp = kStart;
    options.tie_host = rig->start();
    options.stamp_grid = grid;
    source =
        std::make_unique<LiveSource>(std::vector<CameraDevice*>{&rig->camera(0), &rig->camera(1)}, &rig->ins(), &rig->trigger(), options);
  }

  /// The whole drive, on a sealed thread as the estimator's.
  std::vector<LiveItem> drive() {
    std::vector<LiveItem> items;
    items.reserve(1024);
    source->start();
    const SealedScope sealed;
    for (LiveItem item; source->next(&item);) {
      items.push_back(item);
      if (item.kind == LiveItem::Kind::images) source->release(item.set);
    }
    source->join();
    return items;
  }

  std::unique_ptr<mock::MockRig> rig;
  std::unique_ptr<LiveSource> source;
};

int count(const std::vector<LiveItem>& items, LiveItem::Kind kind) {
  int n = 0;
  for (const LiveItem& item : items) n += item.kind == kind ? 1 : 0;
  return n;
}

TEST(LiveSource, bringsEveryPulseAndReadingOnceInOrderAndWithinTheStampsOwnError) {
  Bench b({});
  const auto items = b.drive();
  ASSERT_EQ(count(items, LiveItem::Kind::images), 81);
  EXPECT_GE(count(items, LiveItem::Kind::reading), 480);
  std::uint64_t number = 0, reading = 0;
  for (const LiveItem& item : items) {
    if (item.kind == LiveItem::Kind::images) {
      EXPECT_EQ(item.set.number, number);
      const Stamp truth = kStart + Duration::milliseconds(50) * static_cast<std::int64_t>(number) + Duration::milliseconds(4);
      const Duration error = item.stamp - truth;
      EXPECT_LE(std::abs(error.ns()), item.set.error.ns()) << number;
      ++number;
    } else {
      EXPECT_EQ(item.sample.number, reading);
      const Stamp truth = kStart + Duration::seconds(static_cast<double>(reading) / 120);
      EXPECT_LE(std::abs((item.sample.stamp - truth).ns()), item.sample.stamp_error.ns()) << reading;
      ++reading;
    }
  }
  EXPECT_EQ(b.source->counters().pulses, 81U);
}

TEST(LiveSource, twoRunsOfADriveInVirtualTimeAreTheSameItemByItem) {
  const std::vector<std::string> faults{"camera_gone@2 camera=1 duration_s=1", "duplicate_frames@0 share=0.3 duration_s=0",
                                        "late_frames@1 camera=0 share=0.2 delay_s=0.2 duration_s=2"};
  const auto a = Bench(faults).drive(), b = Bench(faults).drive();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].kind, b[i].kind) << i;
    ASSERT_EQ(a[i].stamp, b[i].stamp) << i;
    ASSERT_EQ(a[i].set.number, b[i].set.number) << i;
    ASSERT_EQ(a[i].set.present, b[i].set.present) << i;
  }
}

TEST(LiveSource, stampsLieOnTheirGridAndNoFartherFromWhereTheyWereThanHalfOfIt) {
  const auto fine = Bench({}).drive(), coarse = Bench({}, false, Duration::microseconds(1)).drive();
  ASSERT_EQ(fine.size(), coarse.size());
  int off = 0;
  for (std::size_t i = 0; i < fine.size(); ++i) {
    EXPECT_EQ(coarse[i].stamp.ns() % 1000, 0);
    EXPECT_LE(std::abs((coarse[i].stamp - fine[i].stamp).ns()), 500);
    if (coarse[i].kind == LiveItem::Kind::reading) {
      EXPECT_EQ(coarse[i].sample.stamp, coarse[i].stamp);
    }
    off += fine[i].stamp.ns() % 1000 != 0 ? 1 : 0;
  }
  EXPECT_GT(off, 100);
}

TEST(LiveSource, aCameraThatWasGoneJoinsTheRightPulsesAgain) {
  Bench b({"camera_gone@2 camera=1 duration_s=1"});
  const auto items = b.drive();
  EXPECT_EQ(count(items, LiveItem::Kind::device_gone), 1);
  EXPECT_EQ(count(items, LiveItem::Kind::device_back), 1);
  for (const LiveItem& item : items) {
    if (item.kind != LiveItem::Kind::images) continue;
    EXPECT_TRUE(item.set.present[0]);
    EXPECT_EQ(item.set.present[1], item.set.number < 40 || item.set.number >= 60) << item.set.number;
    // Both expose at the same instant: a camera paired a pulse off would be 50 ms away.
    EXPECT_LT(item.set.spread, Duration::milliseconds(5)) << item.set.number;
  }
  EXPECT_TRUE(b.source->missing().empty());
}

TEST(LiveSource, everySlotComesBack) {
  Bench b({"duplicate_frames@0 share=0.5 duration_s=0"});
  (void)b.drive();
  EXPECT_GT(b.source->counters().sync.duplicate[0], 10U);
  // Kept slots would have stalled the drive: 81 frames and their doubles go through 24 of them.
  EXPECT_EQ(b.rig->camera(0).statistics().underruns, 0U);
}

TEST(LiveSource, stopEndsTheStreamAmidTheDrive) {
  Bench b({});
  b.source->start();
  LiveItem item;
  ASSERT_TRUE(b.source->next(&item));
  b.source->stop();
  int rest = 0;
  while (b.source->next(&item)) ++rest;
  EXPECT_LE(rest, 256 + 8) << "what was in the ring";
  b.source->join();
}

}  // namespace
}  // namespace vergence::app
