#include "drivers/acquisition/acquired_queue.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace vergence {
namespace {

/// A camera that remembers which slots came back.
class SlotCamera final : public CameraDevice {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const CameraConfiguration&, CameraConfiguration*) noexcept override {
    return DeviceStatus::ok;
  }
  DeviceStatus start(Notifier*) noexcept override { return DeviceStatus::ok; }
  DeviceStatus wait(Duration, Frame*) noexcept override { return DeviceStatus::timeout; }
  ImageView view(FrameSlot slot) const noexcept override {
    ImageView image;
    image.width = 100 + static_cast<int>(slot);
    return image;
  }
  void release(FrameSlot slot) noexcept override { released.push_back(static_cast<int>(slot)); }
  void stop() noexcept override {}
  DeviceTiming timing() const noexcept override { return {}; }
  CameraStatistics statistics() const noexcept override { return {}; }

  std::vector<int> released;

 private:
  DeviceInfo info_{};
};

struct Bench {
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

TEST(AcquiredQueue, givesEverythingInOrderAndThenEnds) {
  Bench b;
  AcquiredQueue queue(b.cameras, true);
  queue.push(frame(3));
  queue.push(AcquiredReading{});
  queue.push(DeviceEvent{DeviceEvent::Kind::board_gone, Stamp(5)});
  queue.finish();
  Acquired item;
  ASSERT_TRUE(queue.next(&item));
  EXPECT_EQ(std::get<AcquiredFrame>(item).rig.images[0].width, 103) << "a view of the slot";
  ASSERT_TRUE(queue.next(&item));
  EXPECT_TRUE(std::holds_alternative<AcquiredReading>(item));
  ASSERT_TRUE(queue.next(&item));
  EXPECT_EQ(std::get<DeviceEvent>(item).stamp, Stamp(5));
  EXPECT_FALSE(queue.next(&item));
  EXPECT_EQ(queue.high_water(), 3U);
}

TEST(AcquiredQueue, slotsOfARefusedFrameGoBackUnseen) {
  Bench b;
  AcquiredQueue queue(b.cameras, true);
  AcquiredQueue::Refused refused;
  refused.set = frame(7).set;
  queue.push(refused);
  EXPECT_TRUE(b.camera.released.empty()) << "not on the producer's thread";
  queue.finish();
  Acquired item;
  EXPECT_FALSE(queue.next(&item));
  EXPECT_EQ(b.camera.released, std::vector<int>{7});
}

TEST(AcquiredQueue, aLateConsumerSkipsToTheNewestImagesOnlyLive) {
  for (const bool wait : {false, true}) {
    Bench b;
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

TEST(AcquiredQueue, aFullOneDropsReadingsLiveAndNothingElse) {
  Bench b;
  AcquiredQueue queue(b.cameras, false);
  for (int i = 0; i < 300; ++i) queue.push(AcquiredReading{});
  const std::uint64_t dropped = queue.dropped_readings();
  EXPECT_EQ(dropped, 300U - queue.high_water());
  std::thread producer([&] {
    queue.push(DeviceEvent{});  // waits for room
    queue.finish();
  });
  std::size_t readings = 0, events = 0;
  for (Acquired item; queue.next(&item);)
    ++(std::holds_alternative<DeviceEvent>(item) ? events : readings);
  producer.join();
  EXPECT_EQ(readings, 300U - dropped);
  EXPECT_EQ(events, 1U);
}

TEST(AcquiredQueue, aProducerThatWaitsForRoomIsFreedByAStop) {
  Bench b;
  AcquiredQueue queue(b.cameras, true);
  std::thread producer([&] {
    for (int i = 0; i < 1000; ++i) queue.push(AcquiredReading{});
    queue.finish();
  });
  queue.stop();
  producer.join();
  std::size_t left = 0;
  for (Acquired item; queue.next(&item);) ++left;
  EXPECT_LE(left, 1000U);
}

}  // namespace
}  // namespace vergence
