#include "core/memory/ring.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <thread>

#include "core/math/random.hpp"

namespace vergence {
namespace {

TEST(Ring, operationsMatchALimitedQueue) {
  Ring<int, 8> ring;
  std::deque<int> model;
  Random random(11);
  int fulls = 0, empties = 0;
  for (int step = 0; step < 20000; ++step) {
    // Long runs of one kind, so that both ends are met.
    if (random.below(2) == (step / 16 % 2 == 0 ? 0U : 1U) || random.below(4) == 0) {
      const int value = static_cast<int>(random.next() >> 1U);
      const bool room = model.size() < ring.capacity();
      ASSERT_EQ(ring.push(value), room);
      if (room) model.push_back(value);
      fulls += room ? 0 : 1;
    } else {
      int value = -1;
      const bool some = !model.empty();
      ASSERT_EQ(ring.pop(&value), some);
      ASSERT_EQ(value, some ? model.front() : -1) << "an empty ring leaves the value alone";
      if (some) model.pop_front();
      empties += some ? 0 : 1;
    }
    ASSERT_EQ(ring.size(), model.size());
    ASSERT_EQ(ring.empty(), model.empty());
    ASSERT_EQ(ring.full(), model.size() == ring.capacity());
  }
  EXPECT_GT(fulls, 10);
  EXPECT_GT(empties, 10);
}

TEST(Ring, twoThreadsLoseAndReorderNothing) {
  struct Message {
    std::uint64_t number;
    // A message written in part would not match its complement.
    std::uint64_t complement;
    std::uint64_t padding[5];
  };
  constexpr std::uint64_t kMessages = 300'000;
  Ring<Message, 16> ring;
  std::thread producer([&ring] {
    for (std::uint64_t i = 0; i < kMessages;) {
      if (ring.push({i, ~i, {}}))
        ++i;
      else
        std::this_thread::yield();
    }
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t expected = 0; expected < kMessages;) {
    Message message{};
    if (!ring.pop(&message)) {
      std::this_thread::yield();
      continue;
    }
    wrong += message.number != expected || message.complement != ~expected ? 1 : 0;
    ++expected;
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_TRUE(ring.empty());
}

}  // namespace
}  // namespace vergence
