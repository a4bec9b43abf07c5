#include "core/memory/frame_pool.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace vergence {
namespace {

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

}  // namespace
}  // namespace vergence
