#include "core/memory/fixed_vector.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <limits>
#include <thread>

#include "core/math/random.hpp"
#include "core/memory/frame_pool.hpp"

namespace vergence {
namespace {

/// Both containers promise the same; a std::vector with a limit is the model they are held against.
template <class Vector>
void walk_beside_a_model(Vector& vector, std::uint64_t seed) {
  Random random(seed);
  std::vector<int> model;
  for (int step = 0; step < 5000; ++step) {
    switch (random.below(8)) {
      // Five of eight operations push, so the vector is sometimes full.
      default: {
        const int value = static_cast<int>(random.below(1000));
        const bool room = model.size() < vector.capacity();
        ASSERT_EQ(vector.push(value), room) << "step " << step;
        if (room) model.push_back(value);
        break;
      }
      case 0:
      case 1:
        if (!model.empty()) {
          const std::size_t n = model.size() - random.below(2);
          vector.truncate(n);
          model.resize(n);
        }
        break;
      case 2:
        if (random.below(20) == 0) {
          vector.clear();
          model.clear();
        }
        break;
    }
    ASSERT_EQ(vector.size(), model.size()) << "step " << step;
    ASSERT_EQ(vector.empty(), model.empty());
    ASSERT_EQ(vector.full(), model.size() == vector.capacity());
    ASSERT_TRUE(std::equal(vector.begin(), vector.end(), model.begin(), model.end()))
        << "step " << step;
    if (!model.empty()) {
      ASSERT_EQ(vector.back(), model.back());
      ASSERT_EQ(vector.span().size(), model.size());
    }
  }
}

TEST(FixedVector, operationsMatchALimitedVector) {
  FixedVector<int, 13> vector;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) walk_beside_a_model(vector, seed), vector.clear();
}

TEST(BoundedVector, operationsMatchALimitedVector) {
  std::array<int, 13> storage{};
  BoundedVector<int> vector(storage);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) walk_beside_a_model(vector, seed), vector.clear();
}

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

TEST(FramePool, slotsAreAlignedPaddedAndApart) {
  Arena arena;
  FramePool pool(70, 5, 3, arena);
  EXPECT_EQ(FramePool::stride(70), 128U);
  EXPECT_EQ(FramePool::stride(64), 64U);
  std::vector<FrameSlot> slots;
  while (const auto slot = pool.acquire()) {
    const auto bytes = pool.writable(*slot);
    std::fill(bytes.begin(), bytes.end(), static_cast<std::uint8_t>(*slot + 1));
    slots.push_back(*slot);
  }
  ASSERT_EQ(slots.size(), 3U);
  for (const FrameSlot slot : slots) {
    const ImageView view = pool.view(slot);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(view.data) % kCacheLine, 0U);
    EXPECT_EQ(view.stride, 128);
    EXPECT_EQ(view.width, 70);
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) ASSERT_EQ(view.at(x, y), slot + 1);
  }
}

TEST(FramePool, secondReleaseOfASlotIsRefused) {
  Arena arena;
  FramePool pool(8, 8, 2, arena);
  const auto a = pool.acquire();
  ASSERT_TRUE(a);
  EXPECT_TRUE(pool.release(*a));
  EXPECT_FALSE(pool.release(*a));
  EXPECT_FALSE(pool.release(2)) << "it has two";
  EXPECT_EQ(pool.available(), 2U);
  const auto b = pool.acquire(), c = pool.acquire();
  ASSERT_TRUE(b && c);
  EXPECT_NE(*b, *c);
  EXPECT_FALSE(pool.acquire());
}

TEST(Arena, piecesAreZeroedAlignedAndApart) {
  Arena arena;
  const auto bytes = arena.make<std::uint8_t>(3, "bytes");
  const auto numbers = arena.make<double>(9, "numbers");
  const auto more = arena.make<std::uint8_t>(1, "more");
  for (const std::uint8_t b : bytes) EXPECT_EQ(b, 0);
  for (const double d : numbers) EXPECT_EQ(d, 0.0);
  for (const void* piece :
       {static_cast<const void*>(bytes.data()), static_cast<const void*>(numbers.data()),
        static_cast<const void*>(more.data())})
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(piece) % kCacheLine, 0U);
  std::memset(bytes.data(), 0xff, bytes.size_bytes());
  for (const double d : numbers) EXPECT_EQ(d, 0.0);
  EXPECT_EQ(arena.used(), 64U + 128U + 64U);
}

TEST(Arena, overflowingSizeIsRefused) {
  Arena arena;
  EXPECT_THROW((void)arena.make<double>(std::numeric_limits<std::size_t>::max(), "too many"),
               std::bad_alloc);
  EXPECT_THROW((void)arena.make<double>(
                   std::numeric_limits<std::size_t>::max() / sizeof(double) + 2, "wraps"),
               std::bad_alloc);
  EXPECT_EQ(arena.used(), 0U);
}

TEST(Arena, objectsHaveTheirDefaultValues) {
  struct Zeros {
    std::uint64_t number = 0;
    const char* text = nullptr;
    std::uint8_t flag = 0;
  };
  struct OneAtItsEnd {
    std::array<std::uint8_t, 200> bytes{};
    std::uint8_t last = 1;
  };
  Arena arena;
  for (const Zeros& z : arena.make<Zeros>(100, "zeros")) {
    EXPECT_EQ(z.number, 0U);
    EXPECT_EQ(z.text, nullptr);
    EXPECT_EQ(z.flag, 0);
  }
  for (const OneAtItsEnd& o : arena.make<OneAtItsEnd>(100, "ones")) {
    EXPECT_EQ(o.bytes[199], 0);
    EXPECT_EQ(o.last, 1);
  }
}

TEST(Arena, rowsListBytesByName) {
  Arena arena;
  (void)arena.make<std::uint8_t>(65, "tracks");
  (void)arena.make<double>(8, "poses");
  (void)arena.make<std::uint8_t>(1, "tracks");
  ASSERT_EQ(arena.rows().size(), 2U);
  EXPECT_STREQ(arena.rows()[0].name, "tracks");
  EXPECT_EQ(arena.rows()[0].bytes, 192U);
  EXPECT_STREQ(arena.rows()[1].name, "poses");
  EXPECT_EQ(arena.rows()[1].bytes, 64U);
  EXPECT_EQ(arena.used(), 256U);
}

}  // namespace
}  // namespace vergence
