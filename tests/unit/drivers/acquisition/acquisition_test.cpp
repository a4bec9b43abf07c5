#include "drivers/acquisition/acquisition.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "core/memory/allocation_guard.hpp"
#include "drivers/sync/durations.hpp"
#include "tests/support/acquired.hpp"
#include "tests/support/idle_camera.hpp"
#include "tests/support/small_mock.hpp"
#include "tests/support/watched_camera.hpp"

namespace vergence {
namespace {

using namespace test;

constexpr Stamp kStart{1'577'836'800'000'000'000};

struct BenchOptions {
  Duration grid = Duration::nanoseconds(1);
  SyncMode mode = SyncMode::frame_counter;
  Duration vary{};
  double seconds = 4;
};

/// A mock rig with tiny pictures in an almost empty town, and the source on top of it.
struct Bench {
  explicit Bench(const std::vector<std::string>& faults, const BenchOptions& b = {}) {
    mock::MockRigOptions o{.duration = Duration::seconds(b.seconds), .reports_read = true};
    rig = std::make_unique<mock::MockRig>(test::small_truth(faults), o);
    for (int k = 0; k < 2; ++k)
      EXPECT_EQ(rig->camera(k).configure(test::small_camera(), nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig->ins().configure(120, nullptr), DeviceStatus::ok);
    TriggerConfiguration pulses{.rate_hz = 20, .vary = b.vary};
    EXPECT_EQ(rig->trigger().configure(pulses, nullptr), DeviceStatus::ok);
    const Acquisition::Options options{
        .sync = {.interval = Duration::milliseconds(50), .mode = b.mode},
        .wait_when_full = true,
        .tie_stamp = kStart,
        .tie_host = rig->start(),
        .stamp_grid = b.grid};
    for (int k = 0; k < 2; ++k) watched.push_back(std::make_unique<WatchedCamera>(&rig->camera(k)));
    source = std::make_unique<Acquisition>(
        std::vector<CameraDevice*>{watched[0].get(), watched[1].get()}, &rig->ins(),
        &rig->trigger(), options);
    times = rig->pulse_times();
  }

  /// The place in `times` of the pulse that this image truly is of.
  [[nodiscard]] std::size_t true_pulse(const SyncedSet& set, std::size_t k) const {
    const Duration edge = watched[k]->edge_of_slot[set.slots[k]] - rig->start();
    const auto after = std::upper_bound(times.begin(), times.end(), edge);
    EXPECT_LT(edge - *std::prev(after), Duration::milliseconds(2));
    return static_cast<std::size_t>(std::prev(after) - times.begin());
  }

  /// The whole drive, on a sealed thread as the estimator's.
  std::vector<Acquired> drive() {
    std::vector<Acquired> items;
    items.reserve(4096);
    pulses_of.reserve(1024);
    EXPECT_FALSE(source->start());
    const SealedScope sealed;
    for (Acquired item; source->next(&item);) {
      items.push_back(item);
      const AcquiredFrame* frame = frame_of(item);
      if (frame == nullptr) continue;
      const SyncedSet& set = frame->set;
      pulses_of.push_back({});
      for (std::size_t k = 0; k < 2; ++k)
        pulses_of.back()[k] = set.present[k] ? static_cast<int>(true_pulse(set, k)) : -1;
      source->release(*frame);
    }
    source->join();
    return items;
  }

  std::unique_ptr<mock::MockRig> rig;
  std::vector<std::unique_ptr<WatchedCamera>> watched;
  // Times of all pulses.
  std::vector<Duration> times;
  // Pulse of every received set per camera; −1 if there is none.
  std::vector<std::array<int, 2>> pulses_of{};
  std::unique_ptr<Acquisition> source;
};

TEST(Acquisition, everyPulseAndReadingComesOnceInOrder) {
  Bench b({});
  const auto items = b.drive();
  ASSERT_EQ(count<AcquiredFrame>(items), 81);
  EXPECT_GE(count<InsRecord>(items), 480);
  std::uint64_t number = 0, reading = 0;
  for (const Acquired& item : items) {
    if (const AcquiredFrame* frame = frame_of(item)) {
      EXPECT_EQ(frame->set.number, number);
      EXPECT_EQ(frame->rig.number, number);
      EXPECT_EQ(frame->rig.pairing, Pairing::assumed) << "counted, nothing proves it";
      const Stamp truth = kStart + Duration::milliseconds(50) * static_cast<std::int64_t>(number) +
                          Duration::milliseconds(4);
      EXPECT_LE(std::abs((frame->rig.stamp - truth).ns()), frame->rig.stamp_error.ns()) << number;
      ++number;
    } else {
      ASSERT_NE(reading_of(item), nullptr);
      const InsSample& sample = reading_of(item)->sample;
      EXPECT_EQ(sample.number, reading);
      const Stamp truth = kStart + Duration::seconds(static_cast<double>(reading) / 120);
      EXPECT_LE(std::abs((sample.stamp - truth).ns()), sample.stamp_error.ns()) << reading;
      ++reading;
    }
  }
  EXPECT_EQ(b.source->counters().pulses, 81U);
}

/// Starts, gives nothing and disconnects, again and again; only the first of these events is
/// reported.
struct EmptyCamera final : test::IdleCamera {
  DeviceStatus start(Notifier*) noexcept override {
    starts.fetch_add(1);
    return DeviceStatus::ok;
  }
  DeviceStatus wait(Duration, Frame* frame) noexcept override {
    frame->arrival = HostStamp(starts.load());
    return DeviceStatus::disconnected;
  }

  std::atomic<int> starts{0};
};

/// Drives a trigger board.
class EmptyBoard final : public TriggerDevice {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const TriggerConfiguration&, TriggerConfiguration*) noexcept override {
    return DeviceStatus::ok;
  }
  DeviceStatus start(Notifier*) noexcept override {
    starts.fetch_add(1);
    return DeviceStatus::ok;
  }
  DeviceStatus wait(Duration, Pulse* pulse) noexcept override {
    pulse->arrival = HostStamp(starts.load());
    return DeviceStatus::disconnected;
  }
  void stop() noexcept override {}
  TriggerStatistics statistics() const noexcept override { return {}; }

  std::atomic<int> starts{0};

 private:
  DeviceInfo info_;
};

TEST(Acquisition, absentDeviceIsRetriedAndReportedOnce) {
  EmptyCamera left, right;
  EmptyBoard board;
  const Acquisition::Options options{
      .sync = {.interval = Duration::milliseconds(50), .mode = SyncMode::approximate_time}};
  Acquisition source({&left, &right}, nullptr, &board, options);
  ASSERT_FALSE(source.start());
  // Number of starts.
  constexpr int kTwiceAgain = 3;
  while (left.starts < kTwiceAgain || right.starts < kTwiceAgain || board.starts < kTwiceAgain) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    source.wake();
  }
  source.stop();
  std::vector<Acquired> items;
  for (Acquired item; source.next(&item);) items.push_back(item);
  source.join();
  EXPECT_EQ(count(items, DeviceEvent::Kind::camera_disconnected), 2) << "each once";
  EXPECT_EQ(count(items, DeviceEvent::Kind::trigger_board_disconnected), 1);
}

TEST(Acquisition, cameraSilentDuringPulsesIsRestarted) {
  Bench b({}, {.mode = SyncMode::board, .seconds = 18});
  b.watched[1]->hangs_from = b.rig->start() + Duration::seconds(4);
  const std::vector<Acquired> items = b.drive();
  EXPECT_EQ(b.watched[0]->starts, 1);
  EXPECT_EQ(b.watched[1]->starts, 2);
  EXPECT_EQ(count(items, DeviceEvent::Kind::camera_disconnected), 1);
  EXPECT_EQ(count(items, DeviceEvent::Kind::camera_reconnected), 1);
  EXPECT_GE(b.pulses_of.back()[1], 0) << "it gives images again";
}

// ---- with the board's pulses

constexpr BenchOptions kByPulses{
    .mode = SyncMode::board, .vary = Duration::milliseconds(2), .seconds = 8};

/// Sets with both images, all of the same pulse, stamped at its middle within the error; the first
/// of them after that time.
void expect_right_pairs(const Bench& b, const std::vector<Acquired>& items, int max_ambiguous = 0) {
  std::size_t i = 0;
  int ambiguous = 0;
  for (const Acquired& item : items) {
    const AcquiredFrame* frame = frame_of(item);
    if (frame == nullptr) continue;
    const SyncedSet& set = frame->set;
    const auto& pulses = b.pulses_of[i++];
    const int first = pulses[0] >= 0 ? pulses[0] : pulses[1];
    if (pulses[0] >= 0 && pulses[1] >= 0) {
      EXPECT_EQ(pulses[0], pulses[1]) << "a wrong pair, set " << set.number;
    }
    const Stamp truth =
        kStart + b.times[static_cast<std::size_t>(first)] + Duration::milliseconds(4);
    EXPECT_LE(std::abs((frame->rig.stamp - truth).ns()), set.error.ns()) << set.number;
    // One that is not verified for the while says so, and is right all the same.
    ambiguous += set.proof == SyncProof::ambiguous ? 1 : 0;
    EXPECT_EQ(frame->rig.pairing,
              set.proof == SyncProof::ambiguous ? Pairing::contradicted : Pairing::verified);
    EXPECT_TRUE(set.proof == SyncProof::numbered || set.proof == SyncProof::ambiguous)
        << to_string(set.proof);
    EXPECT_EQ(set.spread, Duration{}) << "equal exposures of one pulse";
  }
  EXPECT_EQ(i, b.pulses_of.size());
  EXPECT_LE(ambiguous, max_ambiguous);
}

TEST(Acquisition, pulsesVerifyEveryPairWithinASecond) {
  Bench b({}, kByPulses);
  const auto items = b.drive();
  expect_right_pairs(b, items);
  EXPECT_EQ(count(items, DeviceEvent::Kind::pairing_pending), 2);
  EXPECT_EQ(count(items, DeviceEvent::Kind::pairing_verified), 2);
  EXPECT_LE(worst_acquisition(items), 1);
  const AcquisitionCounters& c = b.source->counters();
  EXPECT_EQ(c.pulses, b.times.size());
  EXPECT_EQ(static_cast<std::uint64_t>(count<AcquiredFrame>(items)) + c.sync.acquiring[0],
            b.times.size());
  EXPECT_EQ(c.sync.incomplete, 0U);
  EXPECT_EQ(c.pauses, 0U) << "varied intervals prove it";
}

struct LossCase {
  const char* name;
  std::vector<std::string> faults;
  // Number of verified pairings in total.
  int acquisitions;
  DeviceEvent::Kind kind;
  // Number of events of this kind.
  int items;
};
class AcquisitionByPulses : public ::testing::TestWithParam<LossCase> {};

TEST_P(AcquisitionByPulses, faultsGiveNoWrongPairAndAreReported) {
  Bench b(GetParam().faults, kByPulses), again(GetParam().faults, kByPulses);
  const auto items = b.drive(), more = again.drive();
  expect_right_pairs(b, items, 2);
  EXPECT_EQ(count(items, DeviceEvent::Kind::pairing_verified), GetParam().acquisitions);
  EXPECT_LE(worst_acquisition(items), 1);
  EXPECT_EQ(count(items, GetParam().kind), GetParam().items);
  EXPECT_GT(b.pulses_of.size(), 90U) << "of 160: it came back";
  // Kept slots would stall the drive: its frames and their doubles go through 24 of them.
  EXPECT_EQ(b.rig->camera(0).statistics().underruns, 0U);
  EXPECT_EQ(b.source->counters().clock_resets, 0U) << "another boot's clock is told, not found";
  ASSERT_EQ(items.size(), more.size()) << "another run";
  for (std::size_t i = 0; i < items.size(); ++i) {
    ASSERT_TRUE(same(items[i], more[i])) << i;
  }
}

using Kind = DeviceEvent::Kind;
INSTANTIATE_TEST_SUITE_P(
    Ways, AcquisitionByPulses,
    ::testing::Values(
        LossCase{"camera", {"camera_gone@4 camera=1 duration_s=1"}, 3, Kind::camera_reconnected, 1},
        LossCase{"left", {"camera_gone@4 camera=0 duration_s=1"}, 3, Kind::camera_reconnected, 1},
        LossCase{"reboot", {"board_reboot@4 duration_s=0.5"}, 4, Kind::trigger_board_restarted, 1},
        LossCase{"board", {"board_gone@4 duration_s=1"}, 4, Kind::trigger_board_reconnected, 1},
        LossCase{"line",
                 {"board_gone@4 duration_s=1 powered=1"},
                 2,
                 Kind::trigger_board_disconnected,
                 1},
        LossCase{"missed",
                 {"missed_trigger@4 camera=1 pulses=2", "missed_trigger@6 camera=0"},
                 2,
                 Kind::pairing_pending,
                 2},
        LossCase{"frames", {"lose_frames@3 share=0.2 duration_s=0"}, 2, Kind::pairing_pending, 2},
        LossCase{"pairs", {"break_pairs@3 share=0.5 duration_s=0"}, 2, Kind::pairing_pending, 2},
        LossCase{
            "doubles", {"duplicate_frames@3 share=0.3 duration_s=0"}, 2, Kind::pairing_pending, 2}),
    [](const auto& i) { return std::string(i.param.name); });

TEST(Acquisition, clockDriftAndErrorAreRecorded) {
  Bench b({}, kByPulses);
  (void)b.drive();
  const AcquisitionCounters& c = b.source->counters();
  for (const ClockRecord* clock : {&c.cameras[0], &c.cameras[1], &c.board, &c.ins}) {
    EXPECT_GT(clock->stamps(), 100U);
    EXPECT_LE(std::abs(clock->drift_ppm()), 60)
        << "30 ppm at most, known to as much within eight seconds";
    EXPECT_GT(clock->worst_error(), Duration{});
    // The spread of the delays, and what a crystal may drift within the drive: tighter once the fit
    // knows.
    EXPECT_LE(clock->worst_error(), Duration::milliseconds(2) + Duration::microseconds(200) * 8);
  }
}

TEST(Acquisition, stopEndsTheStream) {
  Bench b({});
  ASSERT_FALSE(b.source->start());
  Acquired item;
  ASSERT_TRUE(b.source->next(&item));
  b.source->stop();
  int rest = 0;
  while (b.source->next(&item)) ++rest;
  EXPECT_LE(rest, 256 + 8) << "what was in the ring";
  b.source->join();
}

/// A camera that remembers which slots came back.
struct SlotCamera final : test::IdleCamera {
  void release(FrameSlot slot) noexcept override { released.push_back(static_cast<int>(slot)); }
  std::vector<int> released;
};

struct QueuedCamera {
  SlotCamera camera;
  std::vector<CameraDevice*> cameras{&camera};
};

AcquiredFrame frame(FrameSlot slot) {
  AcquiredFrame f;
  f.set.number = slot;
  f.set.present[0] = true;
  f.set.slots[0] = slot;
  return f;
}

TEST(AcquiredQueue, refusedFramesReturnTheirSlots) {
  QueuedCamera b;
  AcquiredQueue queue(b.cameras, true);
  AcquiredQueue::Refused refused{.set = frame(7).set};
  queue.push(refused);
  EXPECT_TRUE(b.camera.released.empty()) << "not on the producer's thread";
  queue.finish();
  Acquired item;
  EXPECT_FALSE(queue.next(&item));
  EXPECT_EQ(b.camera.released, std::vector<int>{7});
}

TEST(AcquiredQueue, lateConsumerSkipsOldImagesOnlyLive) {
  for (const bool wait : {false, true}) {
    QueuedCamera b;
    AcquiredQueue queue(b.cameras, wait);
    for (FrameSlot slot = 0; slot < 6; ++slot) queue.push(frame(slot));
    queue.finish();
    Acquired item;
    ASSERT_TRUE(queue.next(&item));
    EXPECT_EQ(std::get<AcquiredFrame>(item).set.number, wait ? 0U : 2U);
    EXPECT_EQ(queue.skipped_sets(), wait ? 0U : 2U);
    EXPECT_EQ(b.camera.released.size(), wait ? 0U : 2U);
  }
}

TEST(AcquiredQueue, fullQueueDropsOnlyReadingsLive) {
  QueuedCamera b;
  AcquiredQueue queue(b.cameras, false);
  for (int i = 0; i < 300; ++i) queue.push(InsRecord{});
  const std::uint64_t dropped = queue.dropped_readings();
  EXPECT_EQ(dropped, 300U - queue.high_water());
  std::thread producer([&] {
    // The call waits for room.
    queue.push(DeviceEvent{});
    queue.finish();
  });
  std::size_t readings = 0, events = 0;
  for (Acquired item; queue.next(&item);)
    ++(std::holds_alternative<DeviceEvent>(item) ? events : readings);
  producer.join();
  EXPECT_EQ(readings, 300U - dropped);
  EXPECT_EQ(events, 1U);
}

constexpr Duration kInterval = Duration::milliseconds(50);
const HostStamp kHost(70'000'000'000);

ClockMapperOptions exact() { return {.min_delay = Duration::milliseconds(1)}; }

TEST(CameraClock, growingExposureIsNoDrift) {
  CameraClock clock(exact());
  for (int n = 0; n < 100; ++n) {
    Frame frame;
    frame.exposure = Duration::milliseconds(2) + Duration::microseconds(100) * n;
    frame.exposure_start = DeviceStamp(0) + kInterval * n;
    // A fixed time after the exposure's end.
    frame.arrival = kHost + kInterval * n + frame.exposure + Duration::milliseconds(1) -
                    Duration::milliseconds(2);
    const MappedStamp start = clock.exposure_start(frame);
    EXPECT_LE(magnitude(start.host - (kHost + kInterval * n)),
              start.error + Duration::microseconds(1))
        << n;
  }
  EXPECT_EQ(clock.resets(), 0U);
}

TEST(PairingTracker, cameraWithoutFramesIsNotReported) {
  PairingTracker watch;
  EXPECT_FALSE(watch.update(0, false, kHost));
  watch.frame(0);
  EXPECT_FALSE(watch.update(1, false, kHost));
  const auto change = watch.update(0, false, kHost);
  ASSERT_TRUE(change);
  EXPECT_FALSE(change->verified);
}

}  // namespace
}  // namespace vergence
