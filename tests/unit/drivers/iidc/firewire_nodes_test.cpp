#include "drivers/iidc/firewire_nodes.hpp"

#include <gtest/gtest.h>

#include "drivers/iidc/identity.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/drivers/iidc/fake_bus.hpp"

namespace vergence::iidc {
namespace {

namespace fs = std::filesystem;

void add_node(const fs::path& root, const std::string& card, const std::string& name,
              const std::vector<std::uint32_t>& rom) {
  const fs::path real = root / "devices" / card / name;
  fs::create_directories(real);
  fs::create_directories(root / "bus/firewire/devices");
  fs::create_symlink(real, root / "bus/firewire/devices" / name);
  std::ofstream out(real / "config_rom", std::ios::binary);
  out.write(reinterpret_cast<const char*>(rom.data()),
            static_cast<std::streamsize>(4 * rom.size()));
}

std::vector<std::uint32_t> model_rom(unsigned index) {
  iidc_camera c{};
  iidc_init(&c, index);
  return {c.rom, c.rom + c.rom_length};
}

TEST(FirewireNodes, camerasAreRecognisedByTheirRom) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(has_firewire(folder.path()));
  EXPECT_TRUE(list_firewire_cameras(folder.path()).empty());
  // The node is the card itself.
  add_node(folder.path(), "card0", "fw0", {0x04040000, 0x31333934, 0, 0, 1, 0});
  add_node(folder.path(), "card0", "fw2", model_rom(1));
  add_node(folder.path(), "card0", "fw1", model_rom(0));
  add_node(folder.path(), "card1", "fw4", model_rom(2));
  // The entry is a unit and not a node.
  add_node(folder.path(), "card0", "fw1.0", model_rom(0));
  // The node has not reported its ROM.
  add_node(folder.path(), "card0", "fw3", std::vector<std::uint32_t>{});
  EXPECT_TRUE(has_firewire(folder.path()));
  const auto nodes = list_firewire_cameras(folder.path());
  ASSERT_EQ(nodes.size(), 3U);
  EXPECT_EQ(nodes[0].device, "/dev/fw1");
  EXPECT_EQ(nodes[1].device, "/dev/fw2");
  EXPECT_EQ(nodes[2].device, "/dev/fw4");
  EXPECT_EQ(nodes[0].bus, nodes[1].bus);
  EXPECT_NE(nodes[0].bus, nodes[2].bus);
  EXPECT_STREQ(nodes[0].rom.model.data(), "Emulated IIDC 0");
}

TEST(Identity, guidIsGivenInHexOrAsSerialNumber) {
  constexpr std::uint64_t kGuid = 0x00B0'9D01'00A1'2345;
  EXPECT_EQ(guid_text(kGuid), "00b09d0100a12345");
  EXPECT_TRUE(names_camera("", kGuid));
  EXPECT_TRUE(names_camera("00b09d0100a12345", kGuid));
  EXPECT_TRUE(names_camera("0x00B09D0100A12345", kGuid));
  // The serial number is 0x00A12345.
  EXPECT_TRUE(names_camera("10560325", kGuid));
  EXPECT_TRUE(names_camera("F3-77", kGuid, "F3-77"));
  EXPECT_FALSE(names_camera("10560326", kGuid));
  EXPECT_FALSE(names_camera("F3-77", kGuid));
  EXPECT_FALSE(names_camera("00b09d0100a1234", kGuid));
  EXPECT_FALSE(names_camera("99999999999999999999999", kGuid));
  EXPECT_FALSE(names_camera("0", 0));
}

}  // namespace
}  // namespace vergence::iidc
