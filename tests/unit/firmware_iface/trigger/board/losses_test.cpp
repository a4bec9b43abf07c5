// A bad line, a host that does not listen, one that sends rubbish.
#include <gtest/gtest.h>

#include <memory>
#include <thread>

#include "firmware_iface/trigger/board/records.h"
#include "tests/unit/firmware_iface/trigger/board/virtual_board.hpp"

namespace vergence {
namespace {

using Bytes = VirtualBoard::Bytes;

TEST(BoardInvalidInput, stalledHostLosesCountedEventsOnly) {
  VirtualBoard b;
  b.start(100'000);
  b.run_for_us(20'000);
  b.frames.clear();
  b.deaf = true;
  b.run_for_us(1'000'000);
  EXPECT_EQ(b.board.outbox.used, outbox_capacity - outbox_for_answers);
  b.send(trigger_ping, {1, 0, 0, 0});
  b.deaf = false;
  b.listen();
  EXPECT_EQ(b.pop(trigger_pong).size(), 1U) << "answers have room of their own";
  b.run_for_us(1'100'000);
  const TriggerStatus s = b.status();
  EXPECT_GT(s.events_dropped, 70U);
  EXPECT_EQ(s.events_dropped, b.board.outbox.dropped);
  EXPECT_GT(s.pulses, 190U) << "pulses go on";
}

TEST(BoardInvalidInput, pingFloodDropsOnlyItsAnswers) {
  VirtualBoard b;
  b.deaf = true;
  for (int i = 0; i < 1000; ++i) b.send(trigger_ping, {1, 0, 0, 0});
  b.deaf = false;
  b.listen();
  EXPECT_EQ(b.pop(trigger_pong).size() + 1, std::size_t{outbox_capacity})
      << "and the STATUS of the start";
  EXPECT_EQ(b.board.outbox.dropped, 1000U - (outbox_capacity - 1));
}

// From interrupts to the main loop.

TEST(BoardRecords, fullRingDropsTheNewestAndCounts) {
  auto ring = std::make_unique<RecordRing>();
  for (std::uint32_t i = 0; i < record_ring_capacity + 5; ++i)
    record_push(ring.get(), {i, 1, true, false});
  EXPECT_EQ(ring->lost, 5U);
  StampRecord record{};
  for (std::uint32_t i = 0; i < record_ring_capacity; ++i) {
    ASSERT_TRUE(record_pop(ring.get(), &record));
    ASSERT_EQ(record.count, i);
  }
  EXPECT_FALSE(record_pop(ring.get(), &record));
}

TEST(BoardRecords, concurrentReadTearsNothingAndCountsLosses) {
  auto ring = std::make_unique<RecordRing>();
  constexpr std::uint32_t kAll = 200'000;
  std::jthread producer([&ring] {
    for (std::uint32_t i = 0; i < kAll; ++i)
      record_push(ring.get(), {i, static_cast<std::uint8_t>(i), (i & 1U) != 0, (i & 2U) != 0});
    record_push(ring.get(), {kAll, 0, false, false});
  });
  std::uint32_t got = 0;
  std::int64_t last = -1;
  StampRecord record{};
  for (bool ended = false; !ended;) {
    const bool over = __atomic_load_n(&ring->written, __ATOMIC_ACQUIRE) +
                          __atomic_load_n(&ring->lost, __ATOMIC_RELAXED) ==
                      kAll + 1;
    while (record_pop(ring.get(), &record)) {
      ++got;
      ASSERT_GT(static_cast<std::int64_t>(record.count), last);
      last = record.count;
      if (record.count == kAll) continue;
      ASSERT_EQ(record.source, static_cast<std::uint8_t>(record.count));
      ASSERT_EQ(record.rising, (record.count & 1U) != 0);
      ASSERT_EQ(record.late, (record.count & 2U) != 0);
    }
    ended = over;
  }
  producer.join();
  EXPECT_EQ(got + ring->lost, kAll + 1);
}

}  // namespace
}  // namespace vergence
