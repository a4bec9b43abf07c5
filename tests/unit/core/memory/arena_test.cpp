#include "core/memory/arena.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>

namespace vergence {
namespace {

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
