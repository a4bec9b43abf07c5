#include "drivers/stream.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

namespace vergence {
namespace {

using Numbers = Stream<int, 4>;

Delivery<int> item(int value) { return {Delivery<int>::What::item, {}, value}; }

void fill(Numbers* numbers) {
  for (int i = 0; !numbers->full(); ++i) ASSERT_TRUE(numbers->push(item(i)));
  EXPECT_FALSE(numbers->push(item(0)));
}

TEST(Stream, takeWakesTheWaitingProducer) {
  Numbers numbers;
  ASSERT_EQ(numbers.start(nullptr), DeviceStatus::ok);
  fill(&numbers);
  auto waiting = std::async(std::launch::async, [&] { numbers.wait_for_room(); });
  Delivery<int> d;
  EXPECT_EQ(numbers.take({}, &d), DeviceStatus::ok);
  waiting.get();
  EXPECT_FALSE(numbers.full());
}

TEST(Stream, stopWakesTheWaitingProducer) {
  Numbers numbers;
  ASSERT_EQ(numbers.start(nullptr), DeviceStatus::ok);
  fill(&numbers);
  auto waiting = std::async(std::launch::async, [&] { numbers.wait_for_room(); });
  EXPECT_EQ(waiting.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  numbers.stop();
  EXPECT_EQ(waiting.wait_for(std::chrono::seconds(5)), std::future_status::ready);
  // Where it was not woken it is let go now, that the test ends.
  (void)numbers.start(nullptr);
  Delivery<int> d;
  (void)numbers.take({}, &d);
}

}  // namespace
}  // namespace vergence
