#include "app/session/memory_figures.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace vergence::app {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;
constexpr std::size_t kPages = 64 << 10;  // bytes: a page of every kernel, and two

TEST(MemoryFigures, anArenaIsResidentWhereItIsWrittenTo) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "under the thread sanitizer all that is mapped is resident";
#endif
  Arena arena(64 * kMiB);
  const auto bytes = arena.make<std::uint8_t>(48 * kMiB, "bytes");
  EXPECT_LE(resident_bytes(arena), kPages) << "zero pages are not touched";
  for (std::size_t i = 0; i < 8 * kMiB; i += 1024) bytes[i] = 1;
  EXPECT_GE(resident_bytes(arena), 8 * kMiB);
  EXPECT_LE(resident_bytes(arena), 8 * kMiB + 2 * kMiB + kPages) << "a huge page at most beyond";
}

TEST(MemoryFigures, theSumIsTheProcesssAndHasItsParts) {
  Arena arena(16 * kMiB);
  for (std::uint8_t& b : arena.make<std::uint8_t>(16 * kMiB, "bytes")) b = 1;
  const ResidentMemory memory = resident_memory({{"arena_bytes", &arena}});
  ASSERT_EQ(memory.arenas.size(), 1U);
  EXPECT_GE(memory.arenas[0].second, 16 * kMiB);
  EXPECT_GT(memory.program, 0U);
  EXPECT_GE(memory.total, memory.arenas[0].second + memory.program);
  std::uint64_t sum = 0, total = 0;
  for (const auto& [name, bytes] : named(memory)) (name == "sum_bytes" ? total : sum) += bytes;
  EXPECT_EQ(sum, total);
}

}  // namespace
}  // namespace vergence::app
