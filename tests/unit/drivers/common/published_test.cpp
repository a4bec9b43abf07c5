#include "drivers/common/published.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

#include "drivers/common/last_error.hpp"

namespace vergence {
namespace {

TEST(Published, aReaderNeverSeesHalfAValue) {
  using Block = std::array<std::uint64_t, 64>;
  Published<Block> published;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    Block b{};
    for (std::uint64_t i = 1; i <= 20'000; ++i) {
      b.fill(i);
      published.offer(b);
    }
    published.set(b);
    done = true;
  });
  bool whole = true;
  while (!done) {
    const Block b = published.get();
    for (const std::uint64_t v : b) whole = whole && v == b[0];
  }
  writer.join();
  EXPECT_TRUE(whole);
  EXPECT_EQ(published.get()[63], 20'000U) << "the last one is set, whoever was reading";
}

}  // namespace
}  // namespace vergence
