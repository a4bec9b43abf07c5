#include "drivers/gige/detail/chunks.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <vector>

#include "core/math/random.hpp"

namespace vergence::gige {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kId = 0x4F2A;
constexpr ChunkField kDouble{kId, 0, 8, true, true};

Bytes big(std::uint64_t value, std::size_t length) {
  Bytes b(length);
  for (std::size_t i = 0; i < length; ++i)
    b[i] = static_cast<std::uint8_t>(value >> (8 * (length - 1 - i)));
  return b;
}
Bytes little(std::uint64_t value, std::size_t length) {
  const Bytes b = big(value, length);
  return {b.rbegin(), b.rend()};
}
/// A chunk behind what there is.
void append(Bytes* tail, std::uint32_t id, const Bytes& data, std::uint32_t length) {
  tail->insert(tail->end(), data.begin(), data.end());
  for (const std::uint32_t word : {id, length}) {
    const Bytes b = big(word, 4);
    tail->insert(tail->end(), b.begin(), b.end());
  }
}
void append(Bytes* tail, std::uint32_t id, const Bytes& data) {
  append(tail, id, data, static_cast<std::uint32_t>(data.size()));
}
/// What is behind the pixels: their tag, then chunks.
Bytes image_tag() {
  Bytes tail;
  append(&tail, 1, {}, 1280 * 960);
  return tail;
}
std::uint64_t bits(double v) { return std::bit_cast<std::uint64_t>(v); }

TEST(GigeChunks, numbersAreReadInEveryFormTheyMayHave) {
  struct Case {
    Bytes data;
    ChunkField field;
  };
  const std::uint32_t single = std::bit_cast<std::uint32_t>(4321.0F);
  const std::vector<Case> cases{{big(bits(4321), 8), {kId, 0, 8, true, true}},
                                {little(bits(4321), 8), {kId, 0, 8, true, false}},
                                {big(single, 4), {kId, 0, 4, true, true}},
                                {little(single, 4), {kId, 0, 4, true, false}},
                                {big(4321, 8), {kId, 0, 8, false, true}},
                                {little(4321, 4), {kId, 0, 4, false, false}},
                                {big(4321, 2), {kId, 0, 2, false, true}},
                                {big(4321, 8), {kId, 4, 4, false, true}},
                                {little(4321ULL << 16U, 8), {kId, 2, 3, false, false}}};
  for (const Case& c : cases) {
    Bytes tail = image_tag();
    append(&tail, 7, Bytes(24, 0xEE));
    append(&tail, kId, c.data);
    append(&tail, 8, Bytes(3, 0xEE));
    EXPECT_EQ(exposure_in_chunks(tail, c.field), Duration::microseconds(4321))
        << c.field.length << " at " << c.field.offset;
  }
}

TEST(GigeChunks, whatIsNotThereIsNothing) {
  Bytes tail = image_tag();
  EXPECT_FALSE(exposure_in_chunks({}, kDouble));
  EXPECT_FALSE(exposure_in_chunks(tail, kDouble)) << "the pixels only";
  EXPECT_FALSE(exposure_in_chunks(tail, {1, 0, 8, true, true})) << "the pixels are no exposure";
  append(&tail, kId, big(bits(100), 8));
  ASSERT_TRUE(exposure_in_chunks(tail, kDouble));
  EXPECT_FALSE(exposure_in_chunks(tail, {kId + 1, 0, 8, true, true}));
  EXPECT_FALSE(exposure_in_chunks(tail, {kId, 1, 8, true, true})) << "ends behind the chunk";
  EXPECT_FALSE(exposure_in_chunks(tail, {kId, 0xFFFFFFFF, 8, true, true}));
  EXPECT_FALSE(exposure_in_chunks(tail, {kId, 0, 9, false, true}));
  EXPECT_FALSE(exposure_in_chunks(tail, {kId, 0, 0, false, true}));
  EXPECT_FALSE(exposure_in_chunks(tail, {kId, 0, 6, true, true})) << "no number of IEEE 754";
}

TEST(GigeChunks, onlyTimesThatAnExposureMayTakeAreTaken) {
  for (const double us : {0.0, -1.0, 6.1e7, 1e300, std::numeric_limits<double>::quiet_NaN(),
                          std::numeric_limits<double>::infinity()}) {
    Bytes tail = image_tag();
    append(&tail, kId, big(bits(us), 8));
    EXPECT_FALSE(exposure_in_chunks(tail, kDouble)) << us;
  }
}

TEST(GigeChunks, emptyChunksAreNotSearchedForEver) {
  for (const int empty : {63, 64}) {
    Bytes tail = image_tag();
    append(&tail, kId, big(bits(100), 8));
    for (int i = 0; i < empty; ++i) append(&tail, 9, {});
    EXPECT_EQ(exposure_in_chunks(tail, kDouble).has_value(), empty == 63);
  }
}

TEST(GigeChunks, noBytesLeadOutsideOfThem) {
  Random random(11);
  Bytes whole = image_tag();
  append(&whole, 7, Bytes(5, 1));
  append(&whole, kId, big(bits(100), 8));
  append(&whole, 8, Bytes(16, 2));
  for (int i = 0; i < 20'000; ++i) {
    // An allocation of exactly this size: the sanitizer sees the first byte beyond.
    Bytes tail(whole.begin(),
               whole.begin() + static_cast<std::ptrdiff_t>(random.uniform() *
                                                           static_cast<double>(whole.size() + 1)));
    for (int k = 0; k < i % 4 && !tail.empty(); ++k)
      tail[static_cast<std::size_t>(random.uniform() * static_cast<double>(tail.size()))] =
          static_cast<std::uint8_t>(random.uniform() * 256);
    tail.shrink_to_fit();
    if (const auto told = exposure_in_chunks(tail, kDouble)) {
      EXPECT_GE(*told, Duration::nanoseconds(1));
      EXPECT_LE(*told, Duration::seconds(60));
    }
  }
}

}  // namespace
}  // namespace vergence::gige
