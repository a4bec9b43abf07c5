#include "firmware_iface/iidc/config_rom.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "tests/unit/firmware_iface/iidc/rom_vector.hpp"

namespace vergence::iidc {
namespace {

TEST(ConfigRom, exampleRomGivesGuidModelAndRegisterBase) {
  const auto q = example_rom();
  ConfigRom rom;
  ASSERT_EQ(parse_config_rom(q, &rom), RomStatus::ok);
  EXPECT_EQ(rom.guid, 0x00B0'9D01'0012'3456U);
  EXPECT_EQ(rom.command_base, 0xFFFF'F0F0'0000U);
  EXPECT_EQ(std::string_view(rom.model.data()), "Flea3");
}

TEST(ConfigRom, truncatedRomIsRefusedOrLosesItsTexts) {
  const auto q = example_rom();
  for (std::size_t n = 0; n < q.size(); ++n) {
    ConfigRom rom;
    const RomStatus status = parse_config_rom(std::span(q).first(n), &rom);
    if (n < 20) {
      EXPECT_NE(status, RomStatus::ok) << n;
      // A refusal leaves the result unchanged.
      EXPECT_EQ(rom.guid, 0U) << n;
    } else {
      ASSERT_EQ(status, RomStatus::ok) << n;
      EXPECT_EQ(rom.model[0], '\0') << n;
    }
  }
}

TEST(ConfigRom, otherDevicesAreRefusedByReason) {
  ConfigRom rom;
  auto q = example_rom();
  q[1] = 0;
  EXPECT_EQ(parse_config_rom(q, &rom), RomStatus::not_1394);
  q = example_rom();
  q[5] = 0xFFFF'0000;
  EXPECT_EQ(parse_config_rom(q, &rom), RomStatus::broken_root);
  q = example_rom();
  // The unit is an SBP-2 disk.
  q[11] = 0x1200'609E;
  EXPECT_EQ(parse_config_rom(q, &rom), RomStatus::no_camera);
  q = example_rom();
  // The unit directory is far outside the ROM.
  q[8] = 0xD1FF'FFFF;
  EXPECT_EQ(parse_config_rom(q, &rom), RomStatus::no_camera);
  q = example_rom();
  q[13] = 0xD4FF'FFFF;
  EXPECT_EQ(parse_config_rom(q, &rom), RomStatus::no_command_base);
  q = example_rom();
  q[16] = 0x3900'0000;
  EXPECT_EQ(parse_config_rom(q, &rom), RomStatus::no_command_base);
}

TEST(ConfigRom, textLeafOfWrongLengthIsLeftOut) {
  ConfigRom rom;
  for (const std::uint32_t header : {0U, 0x0001'0000U, 0x0002'0000U, 0xFFFF'0000U, 0x0006'0000U}) {
    auto q = example_rom();
    // The length is too short for the two leading quadlets or exceeds the ROM.
    q[26] = header;
    ASSERT_EQ(parse_config_rom(q, &rom), RomStatus::ok);
    EXPECT_EQ(rom.model[0], '\0') << std::hex << header;
  }
  auto q = example_rom();
  // Control characters are replaced.
  q[29] = 0x0746'0A80;
  ASSERT_EQ(parse_config_rom(q, &rom), RomStatus::ok);
  EXPECT_EQ(std::string_view(rom.model.data()), "?F??3");
}

TEST(ConfigRom, longTextIsCutAndTerminated) {
  auto q = example_rom();
  q.resize(26 + 1 + 2 + 40, 0x4142'4344);
  q[26] = 42U << 16U;
  for (std::size_t i = 29; i < q.size(); ++i) q[i] = 0x4142'4344;
  ConfigRom rom;
  ASSERT_EQ(parse_config_rom(q, &rom), RomStatus::ok);
  EXPECT_EQ(std::string_view(rom.model.data()).size(), rom.model.size() - 1);
}

}  // namespace
}  // namespace vergence::iidc
