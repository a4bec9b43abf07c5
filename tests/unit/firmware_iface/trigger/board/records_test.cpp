// From interrupts to the main loop.
#include "firmware_iface/trigger/board/records.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>

namespace vergence {
namespace {

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
