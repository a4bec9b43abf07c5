#include "firmware_iface/iidc/config_rom.hpp"

#include <gtest/gtest.h>

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
  struct Row {
    std::size_t at;
    std::uint32_t quadlet;
    RomStatus status;
  };
  for (const Row& row : {Row{1, 0, RomStatus::not_1394},
                         {5, 0xFFFF'0000, RomStatus::broken_root},
                         // The unit is an SBP-2 disk.
                         {11, 0x1200'609E, RomStatus::no_camera},
                         // The unit directory is far outside the ROM.
                         {8, 0xD1FF'FFFF, RomStatus::no_camera},
                         {13, 0xD4FF'FFFF, RomStatus::no_command_base},
                         {16, 0x3900'0000, RomStatus::no_command_base}}) {
    ConfigRom rom;
    auto q = example_rom();
    q[row.at] = row.quadlet;
    EXPECT_EQ(parse_config_rom(q, &rom), row.status) << row.at;
  }
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
