#include "drivers/v4l2/frame_exchange.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>

namespace vergence::v4l2 {
namespace {

std::vector<Mapping> memory(std::size_t count) {
  std::vector<Mapping> list;
  for (std::size_t i = 0; i < count; ++i)
    list.emplace_back(
        ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0), 4096);
  return list;
}

struct Counting final : Notifier {
  void notify() noexcept override { ++count; }
  int count = 0;
};

/// Four buffers that are slots, streaming.
struct Exchange : ::testing::Test {
  Exchange() {
    exchange.use_buffers(60, 40, 64);
    exchange.install(memory(4));
    exchange.begin(&ready, {});
  }
  /// A filled buffer, handed over.
  bool offer(std::uint32_t buffer, std::uint64_t counter,
             FrameStatus status = FrameStatus::complete) {
    const auto slot = exchange.hold_buffer(buffer, 0, kBufferReserve);
    if (!slot) return false;
    Frame offered;
    offered.slot = *slot;
    offered.counter = counter;
    offered.status = status;
    exchange.offer(offered);
    return true;
  }
  Counting ready;
  FrameExchange exchange;
  Frame frame{};
};

TEST_F(Exchange, theKernelKeepsItsReserve) {
  EXPECT_FALSE(exchange.hold_buffer(0, 0, kBufferReserve - 1));
  EXPECT_EQ(exchange.statistics().underruns, 1U);
  EXPECT_TRUE(exchange.hold_buffer(0, 0, kBufferReserve));
}

TEST_F(Exchange, aStopFreesWhatNobodyTookButNotWhatSomebodyHolds) {
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

TEST_F(Exchange, aLossAfterTheStopIsNone) {
  exchange.note_dead_node();
  exchange.end();
  exchange.lose(HostStamp(42));
  EXPECT_EQ(exchange.standing(), DeviceStatus::stopped);
  EXPECT_TRUE(exchange.drain()) << "the owner opens the node anew";
}

}  // namespace
}  // namespace vergence::v4l2
