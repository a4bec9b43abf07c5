#include "drivers/common/frame_queue.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "drivers/clock.hpp"

namespace vergence {
namespace {

struct Counting final : Notifier {
  void notify() noexcept override { ++count; }
  std::atomic<int> count{0};
};

Frame frame(FrameSlot slot, FrameStatus status = FrameStatus::complete) {
  Frame f{.slot = slot, .counter = slot + 100U, .status = status};
  return f;
}

struct Queue : ::testing::Test {
  Queue() { queue.begin(&ready); }
  Counting ready;
  FrameQueue queue;
  Frame out{};
};

TEST_F(Queue, holdsEveryPossibleSlot) {
  for (FrameSlot s = 0; s < FramePool::kMaxSlots; ++s) ASSERT_TRUE(queue.offer(frame(s)));
  EXPECT_EQ(queue.out(), FramePool::kMaxSlots);
  for (FrameSlot s = 0; s < FramePool::kMaxSlots; ++s) {
    ASSERT_EQ(queue.wait({}, &out), DeviceStatus::ok);
    EXPECT_EQ(out.slot, s);
  }
}

TEST_F(Queue, reconnectedDeviceStaysDisconnectedUntilBegin) {
  queue.ready_again();
  EXPECT_EQ(queue.state(), FrameQueue::State::streaming) << "it was never disconnected";
  queue.lose(HostStamp(42));
  queue.ready_again();
  queue.ready_again();
  EXPECT_EQ(queue.state(), FrameQueue::State::reconnected);
  EXPECT_EQ(ready.count, 3) << "told at every call";
  EXPECT_EQ(queue.wait({}, &out), DeviceStatus::disconnected);
  queue.fail(HostStamp(50));
  EXPECT_EQ(queue.wait({}, &out), DeviceStatus::disconnected);
  EXPECT_EQ(out.arrival, HostStamp(50));
  queue.fail();
  EXPECT_EQ(queue.wait({}, &out), DeviceStatus::disconnected);
  EXPECT_EQ(out.arrival, HostStamp(50)) << "as before";
  queue.begin(&ready);
  EXPECT_EQ(queue.wait({}, &out), DeviceStatus::timeout);
}

TEST_F(Queue, stopDeliversNothingAndDrainsTheRest) {
  ASSERT_TRUE(queue.offer(frame(1)));
  ASSERT_TRUE(queue.offer(frame(3)));
  ASSERT_EQ(queue.wait({}, &out), DeviceStatus::ok);
  queue.end();
  EXPECT_EQ(queue.wait({}, &out), DeviceStatus::stopped);
  EXPECT_FALSE(queue.offer(frame(4)));
  queue.lose(HostStamp(42));
  EXPECT_EQ(queue.state(), FrameQueue::State::stopped) << "a loss after the stop is none";
  EXPECT_EQ(ready.count, 2) << "nobody is told after the stop";
  FrameSlot slot = 0;
  ASSERT_TRUE(queue.drain(&slot));
  EXPECT_EQ(slot, 3U);
  EXPECT_FALSE(queue.drain(&slot)) << "1 is held";
  EXPECT_EQ(queue.held(), 1U);
  EXPECT_EQ(queue.out(), 1U);
  queue.begin(nullptr);
  EXPECT_EQ(queue.wait({}, &out), DeviceStatus::timeout);
  EXPECT_TRUE(queue.release(1)) << "over the stop";
  EXPECT_FALSE(queue.release(1)) << "once only";
}

/// Asks again and again, as a drive does, until it is not a time-out or `most` has passed.
DeviceStatus ask(FrameQueue* queue, Duration most, Frame* out) {
  const HostStamp begun = monotonic_now();
  DeviceStatus status = DeviceStatus::timeout;
  while (status == DeviceStatus::timeout && monotonic_now() - begun < most) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    status = queue->wait({}, out);
  }
  return status;
}

constexpr Duration kSilence = Duration::milliseconds(100);
// Limit for a busy machine.
constexpr Duration kAnswer = Duration::seconds(10);

TEST_F(Queue, silentDeviceIsDisconnectedUntilRestarted) {
  const HostStamp begun = monotonic_now();
  queue.begin(&ready, kSilence);
  // One image arrives.
  queue.count_underrun();
  EXPECT_EQ(ask(&queue, kAnswer, &out), DeviceStatus::disconnected);
  EXPECT_GT(out.arrival - begun, kSilence);
  EXPECT_EQ(queue.state(), FrameQueue::State::disconnected);
  EXPECT_FALSE(queue.offer(frame(1)));
  queue.begin(&ready, kSilence);
  EXPECT_EQ(ask(&queue, kSilence * 2, &out), DeviceStatus::timeout) << "again a first image";
  EXPECT_TRUE(queue.offer(frame(1)));
  EXPECT_EQ(queue.wait({}, &out), DeviceStatus::ok);
}

TEST_F(Queue, underrunsAreNoSilence) {
  const HostStamp begun = monotonic_now();
  queue.begin(&ready, kSilence * 20);
  ASSERT_TRUE(queue.offer(frame(1)));
  ASSERT_EQ(queue.wait({}, &out), DeviceStatus::ok);
  while (monotonic_now() - begun < kSilence * 22) {
    queue.count_underrun();
    ASSERT_EQ(ask(&queue, kSilence, &out), DeviceStatus::timeout);
  }
}

TEST_F(Queue, firstImageMayTakeLonger) {
  const HostStamp begun = monotonic_now();
  queue.begin(&ready, kSilence);
  EXPECT_EQ(ask(&queue, kAnswer * 3, &out), DeviceStatus::disconnected);
  EXPECT_GT(out.arrival - begun, Duration::seconds(10));
}

TEST_F(Queue, silenceNeedsContinuousWaiting) {
  queue.begin(&ready, kSilence);
  queue.count_underrun();
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  EXPECT_EQ(queue.wait({}, &out), DeviceStatus::timeout) << "it was away itself";
  EXPECT_EQ(ask(&queue, kAnswer, &out), DeviceStatus::disconnected);
}

TEST(LongestSilence, isTenIntervalsAndAtLeastTwoSeconds) {
  EXPECT_EQ(longest_silence(CameraTrigger::free, 20), Duration::seconds(2));
  EXPECT_EQ(longest_silence(CameraTrigger::free, 0.5), Duration::seconds(20));
  EXPECT_EQ(longest_silence(CameraTrigger::free, 0), Duration{}) << "nobody knows its rate";
  EXPECT_EQ(longest_silence(CameraTrigger::hardware, 20), Duration{});
  EXPECT_EQ(longest_silence(CameraTrigger::software, 20), Duration{});
}

}  // namespace
}  // namespace vergence
