#include "app/doctor/checks.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/unit/app/doctor/fake_machine.hpp"

namespace vergence::app {
namespace {

using test::contains;
using test::FakeMachine;
using test::mends_with;

FoundPort ftdi(const std::string& port, int latency) {
  FoundPort p;
  p.info = {port, "FT232R USB UART", 0x0403, 0x6001, "A1", latency};
  p.kind = serial_kind(0x0403, 0x6001);
  p.by_id = "/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A1-if00-port0";
  return p;
}

TEST(DoctorSerial, theLatencyTimerOfAnInsIsSixteen) {
  FakeMachine f;
  f.inventory.ports = {ftdi("/dev/ttyUSB0", 1)};
  ASSERT_EQ(f.of("latency_timer").size(), 1U);
  EXPECT_EQ(f.of("latency_timer")[0].state, FindingState::advice);
  EXPECT_EQ(f.of("latency_timer")[0].mend[0],
            "echo 16 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer");
  f.inventory.ports = {ftdi("/dev/ttyUSB0", 16)};
  EXPECT_EQ(f.of("latency_timer")[0].state, FindingState::ok);
  f.needs.given = true;
  f.needs.ins_driver = "xsens";
  f.needs.ins_port = "/dev/ttyUSB1";
  EXPECT_TRUE(f.of("latency_timer").empty()) << "somebody else's converter";
}

TEST(DoctorSerial, aPortThatIsConfiguredAndNotThereIsAProblem) {
  FakeMachine f;
  f.needs.given = true;
  f.needs.ins_driver = "xsens";
  EXPECT_TRUE(contains(f.of("ins")[0].sentence, "no serial port on USB"));
  f.needs.ins_port = "/dev/ttyUSB7";
  EXPECT_TRUE(contains(f.of("ins")[0].sentence, "/dev/ttyUSB7 is not there"));
  f.file("/dev/ttyUSB7", "");
  EXPECT_TRUE(f.of("ins").empty());
}

TEST(DoctorSerial, modemManagerIsLeftAloneWhereARuleKeepsItAway) {
  FakeMachine f;
  f.inventory.ports = {ftdi("/dev/ttyUSB0", 16)};
  EXPECT_TRUE(f.of("modem_manager").empty()) << "it does not run";
  f.file("/proc/9/comm", "ModemManager\n");
  EXPECT_EQ(f.of("modem_manager")[0].state, FindingState::advice);
  f.file("/sys/class/tty/ttyUSB0/dev", "188:0\n");
  f.file("/run/udev/data/c188:0", "S:ttyUSB0\nE:ID_MM_PORT_IGNORE=1\n");
  EXPECT_EQ(f.of("modem_manager")[0].state, FindingState::ok);
  f.inventory.ports.clear();
  EXPECT_TRUE(f.of("modem_manager").empty());
}

TEST(DoctorSerial, permissionIsByGroupDialout) {
  FakeMachine f;
  f.group = "dialout";
  f.inventory.ports = {ftdi("/dev/ttyUSB0", 16)};
  f.closed = {"/dev/ttyUSB0"};
  EXPECT_TRUE(mends_with(f.of("serial_permission")[0], "sudo usermod -aG dialout driver"));
}

TEST(DoctorSerial, portsThatNobodyAsksForAreNobodysProblem) {
  FakeMachine f;
  f.inventory.ports = {ftdi("/dev/ttyUSB0", 1)};
  f.closed = {"/dev/ttyUSB0"};
  f.file("/proc/9/comm", "ModemManager\n");
  f.needs.given = true;
  for (const char* check : {"serial_permission", "latency_timer", "modem_manager"})
    EXPECT_TRUE(f.of(check).empty()) << check;
  f.needs.trigger_driver = "board";
  EXPECT_FALSE(f.of("serial_permission").empty());
  EXPECT_TRUE(f.of("latency_timer").empty()) << "a board's stamps do not rest on it";
  f.needs.ins_driver = "xsens";
  f.needs.ins_port = "/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A1-if00-port0";
  EXPECT_FALSE(f.of("latency_timer").empty());
}

/// An INS at `/dev/NAME`, whose adapter the list has, and by a configuration that names it so.
void put_ins(FakeMachine* f, const std::string& name, const std::string& configured) {
  f->file("/dev/" + name, "");
  FoundPort port = ftdi("/dev/" + name, 16);
  if (!name.starts_with("ttyUSB")) {
    port.info.usb_vendor = port.info.usb_product = 0;
    port.by_id.clear();
  }
  f->inventory.ports = {port};
  f->needs.given = true;
  f->needs.ins_driver = "xsens";
  f->needs.ins_port = configured;
  f->group = "dialout";
}

TEST(DoctorSerial, aPortIsJudgedByWhateverLinkItIsNamed) {
  FakeMachine f;
  put_ins(&f, "ttyUSB0", "/dev/vehicle/imu");
  f.file("/dev/vehicle/other", "");
  std::filesystem::create_symlink("../ttyUSB0", f.folder / "dev/vehicle/imu");
  f.inventory.ports[0].info.latency_timer_ms = 1;
  f.closed = {"/dev/ttyUSB0"};
  ASSERT_EQ(f.of("serial_permission").size(), 1U);
  EXPECT_EQ(f.of("serial_permission")[0].state, FindingState::problem);
  EXPECT_FALSE(f.of("latency_timer").empty());
  f.needs.ins_driver.clear();
  f.needs.trigger_driver = "board";
  f.needs.trigger_port = "/dev/vehicle/imu";
  EXPECT_EQ(f.of("serial_permission").size(), 1U);
}

TEST(DoctorSerial, aPortThatNoListHasIsJudgedToo) {
  FakeMachine f;
  put_ins(&f, "ttymxc2", "/dev/ttymxc2");
  f.inventory.ports.clear();
  f.closed = {"/dev/ttymxc2"};
  ASSERT_EQ(f.of("serial_permission").size(), 1U);
  EXPECT_EQ(f.of("serial_permission")[0].state, FindingState::problem);
}

TEST(DoctorSerial, theGroupsNodeHasToBeReadAndWrittenByIt) {
  FakeMachine f;
  put_ins(&f, "ttyUSB0", "/dev/ttyUSB0");
  f.machine.groups = {"dialout"};
  f.closed = {"/dev/ttyUSB0"};
  f.mode = 0640;
  ASSERT_EQ(f.of("serial_permission").size(), 1U);
  EXPECT_EQ(f.of("serial_permission")[0].state, FindingState::problem);
  EXPECT_TRUE(contains(f.of("serial_permission")[0].sentence,
                       "its mode is 0640; rw for the group is needed"));
  EXPECT_EQ(f.of("serial_permission")[0].mend[0], "sudo chmod g+rw /dev/ttyUSB0");
}

TEST(DoctorSerial, aBuiltInPortThatAConsoleHoldsIsNoMatterOfUsbRules) {
  FakeMachine f;
  put_ins(&f, "ttyAMA0", "/dev/ttyAMA0");
  f.machine.groups = {"dialout"};
  f.group = "tty";
  f.closed = {"/dev/ttyAMA0"};
  ASSERT_EQ(f.of("serial_permission").size(), 1U);
  const Finding held = f.of("serial_permission")[0];
  EXPECT_EQ(held.state, FindingState::problem);
  EXPECT_EQ(held.mend[0], "sudo systemctl disable --now serial-getty@ttyAMA0");
  EXPECT_FALSE(mends_with(held, "--write-udev"));
  // As on a Raspberry Pi: the kernel's messages by a link.
  std::filesystem::create_symlink("ttyAMA0", f.folder / "dev/serial0");
  f.file("/proc/cmdline", "console=tty1 console=serial0,115200 root=/dev/mmcblk0p2\n");
  EXPECT_TRUE(contains(f.of("serial_permission")[0].sentence, "console="));
  EXPECT_EQ(f.of("serial_permission")[0].mend[0], "sudo systemctl mask --now serial-getty@ttyAMA0");
}

}  // namespace
}  // namespace vergence::app
