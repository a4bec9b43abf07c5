#include "app/doctor/udev_rules.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/doctor/probe.hpp"
#include "tests/unit/app/doctor/fake_machine.hpp"

namespace vergence::app {
namespace {

using test::contains;

/// The house's own check of udev rules.
testing::AssertionResult holds_as_rules(const std::string& rules) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("98-rig.rules", rules);
  const std::string command = "python3 '" VERGENCE_SOURCE_DIR
                              "/tests/system/house/udev_rules.py' '" +
                              file.string() + "' >'" + (folder / "said").string() + "' 2>&1";
  if (std::system(command.c_str()) == 0) return testing::AssertionSuccess();
  return testing::AssertionFailure() << test::read_file(folder / "said") << rules;
}

FoundPort port(std::uint16_t vendor, std::uint16_t product, const std::string& serial) {
  FoundPort p;
  p.info = {"/dev/ttyUSB0", "FT232R USB UART", vendor, product, serial, 16};
  p.kind = serial_kind(vendor, product);
  return p;
}

UsbDevice usb(std::uint16_t vendor, const std::string& serial, std::vector<std::string> video) {
  UsbDevice d;
  d.port = "1-2";
  d.vendor = vendor;
  d.product = 0x2005;
  d.serial = serial;
  d.title = "A camera";
  d.video = std::move(video);
  return d;
}

TEST(UdevRules, nothingPluggedInIsAFileWithoutRules) {
  const std::string rules = udev_rules(Inventory{});
  EXPECT_TRUE(holds_as_rules(rules));
  EXPECT_FALSE(contains(rules, "GROUP"));
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
  for (const char* name :
       {"vergence/ins-X07", "vergence/serial-A1B2", "vergence/trigger-75",
        "vergence/camera-15021234", "vergence/camera-CAM", "vergence/camera-00b09d0100a1b2c3"})
    EXPECT_TRUE(contains(rules, name)) << name;
  EXPECT_TRUE(contains(rules, "ATTR{guid}==\"0x00b09d0100a1b2c3\""));
  EXPECT_TRUE(contains(rules, "ATTRS{serial}==\"A1B2\", ATTR{latency_timer}=\"16\""));
  EXPECT_TRUE(contains(rules, "ID_MM_DEVICE_IGNORE"));
  EXPECT_TRUE(contains(rules, "ATTR{power/control}=\"on\""));
  EXPECT_FALSE(contains(rules, "mouse"));
}

CameraNeed camera(const std::string& key, const std::string& driver, const std::string& serial) {
  CameraNeed need;
  need.key = key;
  need.driver = driver;
  need.serial = serial;
  return need;
}

/// Two FTDI adapters that look alike, a board, two IIDC cameras on USB and one on IEEE 1394.
Inventory two_rigs() {
  Inventory i;
  i.ports = {port(0x0403, 0x6001, "A1"), port(0x0403, 0x6001, "B2"), port(0x0483, 0x5740, "C3")};
  i.ports[1].info.port = "/dev/ttyUSB1";
  i.ports[2].info.port = "/dev/ttyACM0";
  i.usb = {usb(0x1E10, "1", {}), usb(0x1E10, "2", {})};
  for (int k = 0; k < 2; ++k) {
    UsbDevice& d = i.usb[static_cast<std::size_t>(k)];
    d.bus = 1;
    d.number = 7 + k;
    d.port = k == 0 ? "1-1" : "1-2";
  }
  DriverFindings driver;
  driver.name = "iidc-usb";
  driver.cameras = {{{"iidc-usb", "00b09d0000000001", "Chameleon", "usb 001/007"}, {}, {}},
                    {{"iidc-usb", "00b09d0000000002", "Chameleon", "usb 001/008"}, {}, {}}};
  i.drivers = {driver};
  iidc::FirewireNode node;
  node.rom.guid = 0x00B09D0100A1B2C3;
  i.firewire = {node};
  return i;
}

TEST(UdevRules, aRigsDevicesAreNamedByWhatTheyAreThere) {
  Needs needs;
  needs.given = true;
  needs.ins_driver = "xsens";
  needs.ins_port = "/dev/ttyUSB1";
  needs.trigger_driver = "board";
  needs.cameras = {camera("cameras.0", "iidc-usb", "00b09d0000000002"),
                   camera("cameras.1", "gige", "15021234")};
  const RigDevices rig = rig_devices(two_rigs(), needs);
  EXPECT_TRUE(rig.missing.empty()) << rig.missing.front();
  const std::string rules = udev_rules(rig);
  EXPECT_TRUE(holds_as_rules(rules));
  for (const char* name : {"vergence/ins-B2", "vergence/trigger-C3", "vergence/camera-2"})
    EXPECT_TRUE(contains(rules, name)) << name << "\n" << rules;
  for (const char* other : {"A1", "vergence/camera-1", "firewire"})
    EXPECT_FALSE(contains(rules, other)) << other << "\n" << rules;
}

TEST(UdevRules, whatARigLacksIsSaid) {
  Needs needs;
  needs.given = true;
  needs.ins_driver = "xsens";  // any port: there are two that may be meant
  needs.trigger_driver = "board";
  needs.trigger_port = "/dev/ttyACM7";
  needs.cameras = {camera("cameras.0", "iidc-usb", "00b09d0000000009"),
                   camera("cameras.1", "iidc-1394", "00b09d0100a1b2c3")};
  const RigDevices rig = rig_devices(two_rigs(), needs);
  ASSERT_EQ(rig.missing.size(), 3U);
  EXPECT_EQ(rig.missing[0], "ins: 2 serial ports may be meant; name one in ins.port");
  EXPECT_EQ(rig.missing[1], "trigger: no serial port is there for it");
  EXPECT_EQ(rig.missing[2], "cameras.0 (iidc-usb 00b09d0000000009): it is not plugged in");
  const std::string rules = udev_rules(rig);
  EXPECT_TRUE(holds_as_rules(rules));
  EXPECT_TRUE(contains(rules, "# Left out, cameras.0 (iidc-usb 00b09d0000000009)"));
  EXPECT_TRUE(contains(rules, "vergence/camera-00b09d0100a1b2c3"));
}

TEST(UdevRules, aPortIsNamedInManyWays) {
  FoundPort p = port(0x0403, 0x6001, "A1");
  p.by_id = "/dev/serial/by-id/usb-FTDI_A1-if00-port0";
  for (const char* key : {"", "/dev/ttyUSB0", "ttyUSB0", "A1", "/dev/vergence/ins-A1",
                          "/dev/vergence/trigger-A1", "/dev/serial/by-id/usb-FTDI_A1-if00-port0"})
    EXPECT_TRUE(names_port(key, p)) << key;
  for (const char* key : {"/dev/ttyUSB1", "A", "/dev/vergence/ins-A2"})
    EXPECT_FALSE(names_port(key, p)) << key;
}

TEST(UdevRules, aRigsPortMayBeNamedByAnyLink) {
  const test::FakeMachine f;
  f.file("/dev/ttyUSB1", "");
  f.file("/dev/vehicle/other", "");
  std::filesystem::create_symlink("../ttyUSB1", f.folder / "dev/vehicle/imu");
  Needs needs;
  needs.given = true;
  needs.ins_driver = "xsens";
  needs.ins_port = "/dev/vehicle/imu";
  const RigDevices rig = rig_devices(two_rigs(), with_nodes(needs, f.machine));
  EXPECT_TRUE(rig.missing.empty()) << rig.missing.front();
  EXPECT_TRUE(contains(udev_rules(rig), "vergence/ins-B2"));
}

TEST(UdevRules, aBuiltInPortNeedsNone) {
  Inventory i;
  i.ports = {port(0, 0, "")};
  EXPECT_FALSE(contains(udev_rules(i), "GROUP"));
}

TEST(UdevRules, whatADeviceSaysOfItselfCannotWriteRules) {
  const std::string evil = "x\", RUN+=\"/bin/sh\n* ${env} $attr{x} %k ../../etc";
  Inventory i;
  i.ports = {port(0x0403, 0x6001, evil)};
  i.ports[0].info.description = evil;
  i.ports[0].device = evil;
  i.usb = {usb(0x1E10, evil, {}), usb(0x046D, evil, {"video0"})};
  i.usb[0].title = evil;
  const std::string rules = udev_rules(i);
  EXPECT_TRUE(holds_as_rules(rules));
  for (std::size_t at = 0; at < rules.size();) {
    const std::size_t end = rules.find('\n', at);
    const std::string line = rules.substr(at, end - at);
    at = end + 1;
    if (line.starts_with("#")) continue;
    EXPECT_FALSE(contains(line, "RUN+") || contains(line, "RUN=")) << line;
    EXPECT_FALSE(contains(line, "$")) << line;
    EXPECT_FALSE(contains(line, "*")) << line;
    EXPECT_FALSE(contains(line, "/etc")) << line;
  }
}

TEST(Inventory, nodesOfOneDeviceAreOneCameraAndTwoDevicesWithOneSerialAreTwo) {
  const test::FakeMachine f;
  UsbDevice first = usb(0x046D, "SN0001", {"video0", "video1"}),
            second = usb(0x046D, "SN0001", {"video2"});
  second.port = "1-3";
  const std::vector<DeviceInfo> found{{"v4l2", "SN0001", "Cam", "/dev/video0"},
                                      {"v4l2", "SN0001#1", "Cam infrared", "/dev/video1"},
                                      {"v4l2", "SN0001#2", "Cam", "/dev/video2"},
                                      {"gige", "9", "Other", "10.0.0.2"}};
  const auto all = one_entry_a_device(f.machine, {first, second}, found);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].also, std::vector<std::string>{"SN0001#1"});
  EXPECT_EQ(all[1].info.serial, "SN0001#2");
  EXPECT_EQ(all[2].info.driver, "gige");
}

TEST(Inventory, twoDevicesOfOneParentAreTwo) {
  const test::FakeMachine f;
  f.file("/sys/devices/platform/vivid.0/uevent", "");
  for (const char* node : {"video0", "video1", "video2"}) {
    const auto folder = f.folder / "sys/class/video4linux" / node;
    std::filesystem::create_directories(folder);
    std::filesystem::create_directory_symlink(f.folder / "sys/devices/platform/vivid.0",
                                              folder / "device");
  }
  const std::vector<DeviceInfo> found{{"v4l2", "platform:vivid-000", "vivid", "/dev/video0"},
                                      {"v4l2", "platform:vivid-001", "vivid", "/dev/video1"},
                                      {"v4l2", "platform:vivid-000#1", "vivid", "/dev/video2"}};
  const auto all = one_entry_a_device(f.machine, {}, found);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].also, std::vector<std::string>{"platform:vivid-000#1"});
}

TEST(Inventory, aLineForTheConfigurationIsYamlWhateverTheSerial) {
  EXPECT_EQ(camera_line({"gige", "15021234", "", ""}), "{driver: gige, serial: \"15021234\"}");
  EXPECT_EQ(camera_line({"gige", "", "", "10.0.0.2"}), "{driver: gige, serial: \"10.0.0.2\"}");
  EXPECT_EQ(camera_line({"v4l2", "a\"b\\\n\xff", "", ""}),
            "{driver: v4l2, serial: \"a\\\"b\\\\\\n\\ufffd\"}");
}

/// Notes who was asked; the one named `answers` says that its device is there.
std::vector<Asker> listening(std::vector<std::string>* asked, const std::string& answers) {
  std::vector<Asker> askers;
  for (const auto& [group, driver] : {std::pair{"ins", "xsens"}, std::pair{"trigger", "board"}})
    askers.push_back({group, driver,
                      [asked, answers, name = std::string(driver)](
                          const std::string&) -> std::optional<DeviceInfo> {
                        asked->push_back(name);
                        if (name != answers) return std::nullopt;
                        return DeviceInfo{name, "42", "A model", ""};
                      }});
  return askers;
}

TEST(Probe, asksTheLikelyOneFirstAndNobodyAfterAnAnswer) {
  std::vector<std::string> asked;
  FoundPort p = port(0x0403, 0x6001, "A1");
  probe(&p, listening(&asked, "xsens"));
  EXPECT_EQ(asked, std::vector<std::string>{"xsens"});
  EXPECT_EQ(p.device, "xsens 42, A model");
  EXPECT_EQ(p.configuration, "ins: {driver: xsens, port: /dev/ttyUSB0}");
  asked.clear();
  p = port(0x2E8A, 0x000A, "B");
  p.by_id = "/dev/serial/by-id/board";
  probe(&p, listening(&asked, "board"));
  EXPECT_EQ(asked, std::vector<std::string>{"board"});
  EXPECT_EQ(p.configuration, "trigger: {driver: board, port: /dev/serial/by-id/board}");
}

TEST(Probe, whoDoesNotAnswerIsNobody) {
  std::vector<std::string> asked;
  FoundPort p = port(0x1234, 0x5678, "C");
  probe(&p, listening(&asked, ""));
  EXPECT_EQ(asked, (std::vector<std::string>{"board", "xsens"}));
  EXPECT_EQ(p.device + p.configuration, "");
}

TEST(Probe, leavesAloneWhatCannotBeThatDevice) {
  std::vector<std::string> asked;
  FoundPort p = port(0, 0, "");
  probe(&p, listening(&asked, "board"));
  EXPECT_TRUE(asked.empty());
  p = port(0x2639, 0x0300, "X");
  probe(&p, listening(&asked, "board"));
  EXPECT_EQ(asked, std::vector<std::string>{"xsens"});
}

}  // namespace
}  // namespace vergence::app
