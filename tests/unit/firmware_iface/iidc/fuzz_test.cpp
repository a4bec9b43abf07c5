#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

#include "firmware_iface/iidc/frame_info.hpp"
#include "tests/unit/firmware_iface/iidc/rom_vector.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace vergence::iidc {
namespace {

TEST(IidcFuzz, MutatedRomsGiveAStatusAndNothingElse) {
  std::mt19937 random(20130506);  // mt19937's numbers are fixed by the standard
  const auto rom = example_rom();
  std::vector<std::uint8_t> good(rom.size() * 4);
  std::memcpy(good.data(), rom.data(), good.size());
  for (int round = 0; round < 100'000; ++round) {
    std::vector<std::uint8_t> bytes = good;
    bytes.resize(random() % 4 == 0 ? random() % 1200 : bytes.size());
    if (bytes.empty()) continue;
    for (unsigned n = random() % 8; n > 0; --n)
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    (void)LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
}

TEST(IidcFuzz, EveryFrameInfoRegisterGivesALayoutThatFits) {
  const std::vector<std::uint8_t> image(40, 0xFF);
  for (std::uint32_t q = 0; q < 4096; ++q)
    for (const std::uint32_t present : {0U, kFrameInfoPresent}) {
      const FrameInfoLayout layout = FrameInfoLayout::of(q | present);
      ASSERT_LE(layout.size(), image.size());
      for (unsigned i = 0; i < kFrameInfoItems; ++i) {
        const auto item = static_cast<FrameInfoItem>(i);
        ASSERT_TRUE(!layout.has(item) || layout.read(item, image) == 0xFFFF'FFFFU);
      }
    }
}

}  // namespace
}  // namespace vergence::iidc
