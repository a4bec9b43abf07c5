#include "drivers/acquisition/acquired_queue.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "tests/support/idle_camera.hpp"

namespace vergence {
namespace {

/// A camera that remembers which slots came back.
struct SlotCamera final : test::IdleCamera {
  void release(FrameSlot slot) noexcept override { released.push_back(static_cast<int>(slot)); }
  std::vector<int> released;
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

TEST(AcquiredQueue, refusedFramesReturnTheirSlots) {
  Bench b;
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

TEST(AcquiredQueue, fullQueueDropsOnlyReadingsLive) {
  Bench b;
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

}  // namespace
}  // namespace vergence
