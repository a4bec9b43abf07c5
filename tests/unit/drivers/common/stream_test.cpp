#include "drivers/stream.hpp"

#include <gtest/gtest.h>

#include <future>

namespace vergence {
namespace {

using Numbers = Stream<int, 4>;

Delivery<int> item(int value) { return {Delivery<int>::What::item, {}, value}; }

/// A full stream, and a producer that waits for room in it.
struct FullStream : testing::Test {
  FullStream() {
    EXPECT_EQ(numbers.start(nullptr), DeviceStatus::ok);
    for (int i = 0; !numbers.full(); ++i) EXPECT_TRUE(numbers.push(item(i)));
    EXPECT_FALSE(numbers.push(item(0)));
    waiting = std::async(std::launch::async, [this] { numbers.wait_for_room(); });
  }
  Numbers numbers;
  std::future<void> waiting;
  Delivery<int> d{};
};

TEST_F(FullStream, takeWakesTheWaitingProducer) {
  EXPECT_EQ(numbers.pop({}, &d), DeviceStatus::ok);
  waiting.get();
  EXPECT_FALSE(numbers.full());
}

TEST_F(FullStream, stopWakesTheWaitingProducer) {
  EXPECT_EQ(waiting.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  numbers.stop();
  EXPECT_EQ(waiting.wait_for(std::chrono::seconds(5)), std::future_status::ready);
  // A producer that was not woken is released here, because the test ends.
  (void)numbers.start(nullptr);
  (void)numbers.pop({}, &d);
}

}  // namespace
}  // namespace vergence
