#include "drivers/v4l2/frame_exchange.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstring>

namespace vergence::v4l2 {
namespace {

std::vector<Mapping> memory(std::size_t count, int fill = 0) {
  std::vector<Mapping> list;
  for (std::size_t i = 0; i < count; ++i) {
    void* at = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    std::memset(at, fill + static_cast<int>(i), 4096);
    list.emplace_back(at, 4096);
  }
  return list;
}

/// Four buffers that are slots, streaming.
struct Exchange : ::testing::Test {
  Exchange() {
    exchange.use_buffers(60, 40, 64);
    exchange.install(memory(4));
    exchange.begin(nullptr, {});
  }
  /// A filled buffer, handed over.
  bool offer(std::uint32_t buffer, std::uint64_t counter,
             FrameStatus status = FrameStatus::complete) {
    const auto slot = exchange.hold_buffer(buffer, 0, kBufferReserve);
    if (!slot) return false;
    Frame offered{.slot = *slot, .counter = counter, .status = status};
    exchange.offer(offered);
    return true;
  }
  FrameExchange exchange;
  Frame frame{};
};

TEST_F(Exchange, kernelKeepsItsReserve) {
  EXPECT_FALSE(exchange.hold_buffer(0, 0, kBufferReserve - 1));
  EXPECT_EQ(exchange.statistics().underruns, 1U);
  EXPECT_TRUE(exchange.hold_buffer(0, 0, kBufferReserve));
}

TEST_F(Exchange, stopFreesUntakenButNotHeldBuffers) {
  ASSERT_TRUE(offer(1, 5));
  ASSERT_TRUE(offer(3, 6));
  ASSERT_EQ(exchange.wait({}, &frame), DeviceStatus::ok);
  exchange.end();
  EXPECT_FALSE(exchange.drain());
  EXPECT_EQ(exchange.wait({}, &frame), DeviceStatus::stopped);
  EXPECT_TRUE(exchange.busy()) << "one is held";
  const auto free = exchange.free_buffers();
  EXPECT_EQ(free.count, 3U);
  for (const std::uint32_t buffer : free.list()) EXPECT_NE(buffer, 1U);
}

TEST_F(Exchange, lossAfterStopIsIgnored) {
  exchange.record_dead_node();
  exchange.end();
  exchange.lose(HostStamp(42));
  EXPECT_EQ(exchange.standing(), DeviceStatus::stopped);
  EXPECT_TRUE(exchange.drain()) << "the owner opens the node anew";
}

TEST(V4l2Slots, imageMayFollowAHeader) {
  Slots slots;
  slots.use_buffers(60, 40, 64);
  slots.install(memory(4, 10));
  const FrameSlot slot = slots.hold_buffer(0, 128);
  EXPECT_EQ(slots.view(slot).data, slots.buffer(0).data() + 128);
}

TEST(V4l2Slots, heldImageOutlivesTheCamera) {
  Slots slots;
  slots.use_buffers(60, 40, 64);
  slots.install(memory(4, 10));
  const FrameSlot old = slots.hold_buffer(1);
  // The cable is unplugged.
  slots.install({});
  slots.install(memory(4, 20));
  EXPECT_EQ(slots.view(old).at(0, 0), 11) << "still its pixels";
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_TRUE(slots.may_enqueue(i));
    const FrameSlot slot = slots.hold_buffer(i);
    EXPECT_NE(slot, old);
    EXPECT_EQ(slots.view(slot).at(0, 0), 20 + i);
    EXPECT_EQ(slots.release(slot), i);
  }
  EXPECT_EQ(slots.release(old), std::nullopt) << "nobody's buffer any more";
  EXPECT_EQ(slots.held(), 0U);
}

TEST(V4l2Slots, imagesOfAnotherLayoutDoNotFit) {
  Slots slots;
  slots.use_buffers(60, 40, 64);
  EXPECT_TRUE(slots.fit(true, 64));
  EXPECT_FALSE(slots.fit(true, 80)) << "rows of another length";
  EXPECT_FALSE(slots.fit(false, 64)) << "to be turned to grey";
  slots.use_pool(60, 40);
  EXPECT_TRUE(slots.fit(false, 128));
  EXPECT_TRUE(slots.fit(false, 256)) << "the pool has rows of its own";
  EXPECT_FALSE(slots.fit(true, 64));
}

TEST(V4l2Slots, buffersBeyondTheSlotsAreNotUsed) {
  Slots slots;
  slots.use_buffers(60, 40, 64);
  std::vector<FrameSlot> held;
  for (int camera = 0; camera < 3; ++camera) {
    slots.install(memory(32, 0));
    for (std::uint32_t i = 0; i < 32; ++i)
      if (slots.may_enqueue(i)) held.push_back(slots.hold_buffer(i));
  }
  EXPECT_EQ(held.size(), Slots::kMax);
  for (const FrameSlot slot : held) (void)slots.release(slot);
  EXPECT_EQ(slots.held(), 0U);
}

}  // namespace
}  // namespace vergence::v4l2
