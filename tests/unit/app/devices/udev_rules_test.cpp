#include "app/devices/inventory_report.hpp"

#include <cstdlib>

#include "tests/unit/app/devices/fake_machine.hpp"

namespace vergence::app {
namespace {

using test::contains;
using test::port;

/// The repository's own check of udev rules.
testing::AssertionResult holds_as_rules(const std::string& rules) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("98-rig.rules", rules);
  const std::string command = "python3 '" VERGENCE_SOURCE_DIR
                              "/tests/system/repository/udev_rules.py' '" +
                              file.string() + "' >'" + (folder / "out").string() + "' 2>&1";
  if (std::system(command.c_str()) == 0) return testing::AssertionSuccess();
  return testing::AssertionFailure() << test::read_file(folder / "out") << rules;
}

UsbDevice usb(std::uint16_t vendor, const std::string& serial, std::vector<std::string> video) {
  return {.port = "1-2",
          .vendor = vendor,
          .product = 0x2005,
          .serial = serial,
          .title = serial,
          .video = std::move(video)};
}

TEST(UdevRules, everyDeviceIsNamedByItsSerial) {
  Inventory i;
  i.ports = {port(0x2639, 0x0300, "X07"), port(0x0403, 0x6001, "A1B2"), port(0x2341, 0x0043, "75")};
  i.usb = {usb(0x1E10, "15021234", {}), usb(0x046D, "CAM", {"video0", "video1"}),
           usb(0x1234, "mouse", {})};
  iidc::FirewireNode node;
  node.device = "/dev/fw1";
  node.rom.guid = 0x00B09D0100A1B2C3;
  std::strcpy(node.rom.model.data(), "Flea2");
  i.firewire = {node};
  const std::string rules = udev_rules(i);
  EXPECT_TRUE(holds_as_rules(rules));
  for (const char* part :
       {"vergence/ins-X07", "vergence/serial-A1B2", "vergence/trigger-75",
        "vergence/camera-15021234", "vergence/camera-CAM", "vergence/camera-00b09d0100a1b2c3",
        "ATTR{guid}==\"0x00b09d0100a1b2c3\"", "ATTRS{serial}==\"A1B2\", ATTR{latency_timer}=\"16\"",
        "ID_MM_DEVICE_IGNORE", "ATTR{power/control}=\"on\""})
    EXPECT_TRUE(contains(rules, part)) << part;
  EXPECT_FALSE(contains(rules, "mouse"));
}

TEST(UdevRules, portsOfRigAreNamedByConfiguredDevice) {
  const test::FakeMachine f;
  Inventory i;
  i.ports = {port(0x0403, 0x6001, "A1"), port(0x0403, 0x6001, "B2"), port(0x0483, 0x5740, "C3")};
  i.ports[1].info.port = "/dev/ttyUSB1";
  i.ports[2].info.port = "/dev/ttyACM0";
  i.usb = {usb(0x1E10, "1", {})};
  Configuration needs;
  needs.ins.driver = "xsens";
  needs.ins.port = "/dev/ttyUSB1";
  needs.trigger.driver = "board";
  needs.trigger.port = "C3";
  const std::string rules = udev_rules(ports_of_rig(i, needs, f.machine));
  EXPECT_TRUE(holds_as_rules(rules));
  for (const char* name : {"vergence/ins-B2", "vergence/trigger-C3", "vergence/camera-1"})
    EXPECT_TRUE(contains(rules, name)) << name << "\n" << rules;
  EXPECT_FALSE(contains(rules, "A1")) << rules;
}

TEST(UdevRules, textOfDeviceCannotAddRules) {
  const std::string evil = "x\", RUN+=\"/bin/sh\n* ${env} $attr{x} %k ../../etc";
  Inventory i;
  i.ports = {port(0x0403, 0x6001, evil)};
  i.ports[0].info.description = evil;
  i.usb = {usb(0x1E10, evil, {}), usb(0x046D, evil, {"video0"})};
  const std::string rules = udev_rules(i);
  EXPECT_TRUE(holds_as_rules(rules));
  std::istringstream lines(rules);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("#")) continue;
    for (const char* part : {"RUN+", "RUN=", "$", "*", "/etc"})
      EXPECT_FALSE(contains(line, part)) << line;
  }
}

}  // namespace
}  // namespace vergence::app
