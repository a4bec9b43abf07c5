#include "app/doctor/checks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/unit/app/doctor/fake_machine.hpp"

namespace vergence::app {
namespace {

using test::contains;
using test::FakeMachine;
using test::mends_with;

constexpr std::uint32_t kHost = 0xC0A80A01U, kMask24 = 0xFFFFFF00U;  // 192.168.10.1/24

/// A GigE camera of 1280 x 960 at 30 Hz on eth1.
void put_gige(FakeMachine* f) {
  f->camera("gige", "15021234", "192.168.10.11");
  f->need("gige", "15021234", 1280, 960, 30);
  f->address("eth1", kHost, kMask24);
  f->file("/sys/class/net/eth1/mtu", "9000\n");
  f->file("/sys/class/net/eth1/speed", "1000\n");
  f->file("/proc/sys/net/core/rmem_max", "10485760\n");
}

TEST(Doctor, aBareMachineIsNoWallOfNotFound) {
  const FakeMachine f;
  for (const Finding& finding : f.examined())
    EXPECT_EQ(finding.state, FindingState::ok) << finding.check << ": " << finding.sentence;
  EXPECT_LE(f.examined().size(), 3U);
}

TEST(Doctor, unreadableAndNonsensicalFilesAreNoFindings) {
  FakeMachine f;
  put_gige(&f);
  f.file("/proc/sys/net/core/rmem_max", "a lot\n");
  f.file("/sys/class/net/eth1/mtu", "-3\n");
  f.file("/sys/class/net/eth1/speed", "999999999999\n");
  f.file("/sys/module/usbcore/parameters/usbfs_memory_mb", "\xff\xfe");
  f.file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "");
  f.file("/sys/devices/system/cpu/cpux/cpufreq/scaling_governor", "powersave");
  f.file("/sys/devices/system/clocksource/clocksource0/current_clocksource", "\n");
  f.file("/proc/self/status", "CapEff:");
  f.file("/etc/group", ":::::\nvideo\n");
  EXPECT_TRUE(f.of("receive_buffer").empty());
  EXPECT_TRUE(f.of("governor").empty());
  EXPECT_TRUE(f.of("clock_source").empty());
}

TEST(Doctor, worstFirst) {
  FakeMachine f;
  put_gige(&f);
  f.file("/proc/sys/net/core/rmem_max", "212992\n");
  f.file("/sys/class/net/eth1/mtu", "1500\n");
  const auto findings = f.examined();
  EXPECT_TRUE(std::is_sorted(findings.begin(), findings.end(),
                             [](const auto& a, const auto& b) { return a.state > b.state; }));
  EXPECT_EQ(findings.front().check, "receive_buffer");
}

TEST(DoctorNetwork, theReceiveBufferIsHeldAgainstTheImages) {
  FakeMachine f;
  put_gige(&f);
  ASSERT_EQ(f.of("receive_buffer").size(), 1U);
  EXPECT_EQ(f.of("receive_buffer")[0].state, FindingState::ok);
  f.file("/proc/sys/net/core/rmem_max", "4194304\n");  // three images
  EXPECT_EQ(f.of("receive_buffer")[0].state, FindingState::advice);
  f.file("/proc/sys/net/core/rmem_max", "212992\n");
  const Finding bad = f.of("receive_buffer")[0];
  EXPECT_EQ(bad.state, FindingState::problem);
  ASSERT_EQ(bad.mend.size(), 2U);
  EXPECT_EQ(bad.mend[0], "sudo sysctl -w net.core.rmem_max=10485760");
  EXPECT_TRUE(contains(bad.mend[1], "/etc/sysctl.d/90-vergence-rmem.conf"));
  f.file("/proc/self/status", "CapEff:\t0000000000001000\n");  // CAP_NET_ADMIN
  EXPECT_EQ(f.of("receive_buffer")[0].state, FindingState::ok);
}

TEST(DoctorNetwork, whatLastsIsReadAfterThePackagesOwnSetting) {
  FakeMachine f;
  put_gige(&f);
  f.file("/proc/sys/net/core/rmem_max", "212992\n");
  const std::string command = f.of("receive_buffer")[0].mend.back();
  const std::string name = std::filesystem::path(command).filename();
  int files = 0;
  for (const auto& file : std::filesystem::directory_iterator(VERGENCE_SOURCE_DIR "/packaging")) {
    if (file.path().extension() != ".conf") continue;
    ++files;
    EXPECT_GT(name, file.path().filename().string()) << "the last one counts";
  }
  EXPECT_GT(files, 0);
}

TEST(DoctorNetwork, aLargerImageNeedsMoreThanTheUsualAdvice) {
  FakeMachine f;
  put_gige(&f);
  f.needs.cameras[0].bytes = 12e6;
  EXPECT_TRUE(mends_with(f.of("receive_buffer")[0], "net.core.rmem_max=96000000"));
}

TEST(DoctorNetwork, packetsShouldBeLarge) {
  FakeMachine f;
  put_gige(&f);
  EXPECT_EQ(f.of("mtu")[0].state, FindingState::ok);
  f.file("/sys/class/net/eth1/mtu", "1500\n");
  EXPECT_EQ(f.of("mtu")[0].state, FindingState::advice);
  EXPECT_TRUE(mends_with(f.of("mtu")[0], "sudo ip link set dev eth1 mtu 9000"));
}

TEST(DoctorNetwork, aCameraInAnotherNetworkIsAProblem) {
  FakeMachine f;
  put_gige(&f);
  f.camera("gige", "2", "169.254.7.1");
  f.file("/sys/class/net/eth1/device/vendor", "x");
  f.file("/sys/class/net/eth1/carrier", "1\n");
  const auto found = f.of("camera_network");
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].state, FindingState::problem);
  EXPECT_TRUE(contains(found[0].sentence,
                       "169.254.7.1 is in no network of this host (eth1 192.168.10.1/24)"))
      << found[0].sentence;
  EXPECT_TRUE(mends_with(found[0], "sudo ip addr add 169.254.7.2/16 dev eth1"));
  EXPECT_EQ(found[1].state, FindingState::ok);
}

TEST(DoctorNetwork, camerasShareTheLink) {
  FakeMachine f;
  put_gige(&f);
  f.camera("gige", "2", "192.168.10.12");
  f.need("gige", "2", 1280, 960, 30);
  ASSERT_EQ(f.of("link").size(), 1U);
  EXPECT_EQ(f.of("link")[0].state, FindingState::ok) << f.of("link")[0].sentence;
  for (CameraNeed& n : f.needs.cameras) n.rate_hz = 50;
  EXPECT_EQ(f.of("link")[0].state, FindingState::problem);
  EXPECT_TRUE(contains(f.of("link")[0].sentence, "they fit up to 42")) << f.of("link")[0].sentence;
  f.file("/sys/class/net/eth1/speed", "100\n");
  const auto slow = f.of("link");
  EXPECT_TRUE(std::any_of(slow.begin(), slow.end(), [](const Finding& x) {
    return contains(x.sentence, "runs at 100 Mbit/s");
  }));
}

TEST(DoctorNetwork, twoInterfacesInOneNetworkLoseWhatComesInByTheOther) {
  FakeMachine f;
  put_gige(&f);
  f.address("eth0", kHost + 1, kMask24);
  ASSERT_EQ(f.of("rp_filter").size(), 1U);
  EXPECT_EQ(f.of("rp_filter")[0].state, FindingState::advice);
  f.file("/proc/sys/net/ipv4/conf/all/rp_filter", "1\n");
  EXPECT_EQ(f.of("rp_filter")[0].state, FindingState::problem);
  EXPECT_TRUE(mends_with(f.of("rp_filter")[0], "sudo sysctl -w net.ipv4.conf.eth1.rp_filter=2"));
  f.file("/proc/sys/net/ipv4/conf/eth1/rp_filter", "2\n");
  EXPECT_EQ(f.of("rp_filter")[0].state, FindingState::advice) << "the larger of the two counts";
}

TEST(DoctorNetwork, thePacketSocketNeedsACapabilityOnlyWhenAskedFor) {
  FakeMachine f;
  put_gige(&f);
  EXPECT_TRUE(f.of("packet_socket").empty());
  f.needs.cameras[0].options = gige::Options{.packet_socket = true};
  EXPECT_EQ(f.of("packet_socket")[0].state, FindingState::problem);
  EXPECT_TRUE(mends_with(f.of("packet_socket")[0], "setcap cap_net_raw+ep"));
  f.file("/proc/self/status", "CapEff:\t0000000000002000\n");
  EXPECT_EQ(f.of("packet_socket")[0].state, FindingState::ok);
}

TEST(DoctorCameras, whatIsAskedForAndNotThereIsNamed) {
  FakeMachine f;
  f.camera("v4l2", "A", "/dev/video0");
  f.need("v4l2", "", 640, 480, 30);
  f.need("v4l2", "B", 640, 480, 30);
  const auto found = f.of("cameras");
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].state, FindingState::problem);
  EXPECT_TRUE(contains(found[0].sentence, "cameras.1: the v4l2 camera \"B\" (there: A)"))
      << found[0].sentence;
  EXPECT_TRUE(contains(found[1].sentence, "cameras.0 is v4l2 A"));
}

TEST(DoctorCameras, anEmptySerialLeavesTheNamedOnesToThoseWhoNameThem) {
  FakeMachine f;
  f.camera("v4l2", "A", "/dev/video0");
  f.camera("v4l2", "B", "/dev/video2");
  f.need("v4l2", "", 640, 480, 30);
  f.need("v4l2", "A", 640, 480, 30);
  const auto matched = match_cameras({f.machine, f.inventory, f.needs, "."});
  ASSERT_EQ(matched.size(), 2U);
  EXPECT_EQ(matched[0]->info.serial, "B");
  EXPECT_EQ(matched[1]->info.serial, "A");
}

TEST(DoctorCameras, permissionsSayWhichOfThreeThingsIsMissing) {
  FakeMachine f;
  f.file("/sys/class/video4linux/video0/index", "0");
  f.file("/dev/video0", "");
  EXPECT_EQ(f.of("camera_permission")[0].state, FindingState::ok);
  f.closed = {"/dev/video0"};
  EXPECT_TRUE(mends_with(f.of("camera_permission")[0], "sudo usermod -aG video driver"));
  f.file("/etc/group", "video:x:44:driver\n");
  EXPECT_TRUE(contains(f.of("camera_permission")[0].sentence, "log out and in again"));
  f.machine.groups = {"video"};
  f.group = "root";
  const auto found = f.of("camera_permission");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(mends_with(found[0], "vergence devices --write-udev"));
}

TEST(DoctorCameras, aClosedNodeIsAProblemWhateverTheGroupsSay) {
  FakeMachine f;
  f.file("/sys/class/video4linux/video0/index", "0");
  f.file("/dev/video0", "");
  f.closed = {"/dev/video0"};
  f.machine.groups = {"video"};
  f.mode = 0640;
  ASSERT_EQ(f.of("camera_permission").size(), 1U);
  const Finding narrow = f.of("camera_permission")[0];
  EXPECT_EQ(narrow.state, FindingState::problem);
  EXPECT_TRUE(contains(narrow.sentence, "its mode is 0640; rw for the group is needed"));
  EXPECT_TRUE(mends_with(narrow, "vergence devices --write-udev"));
  f.mode = 0660;
  ASSERT_EQ(f.of("camera_permission").size(), 1U);
  EXPECT_EQ(f.of("camera_permission")[0].state, FindingState::problem) << "by an access list";
}

TEST(DoctorCameras, nodesThatNobodyAsksForAreNobodysProblem) {
  FakeMachine f;
  f.file("/sys/class/video4linux/video0/index", "0");
  f.file("/dev/video0", "");
  f.closed = {"/dev/video0"};
  f.need("mock", "", 640, 480, 20);
  EXPECT_TRUE(f.of("camera_permission").empty()) << "a laptop's own camera";
  f.need("v4l2", "", 640, 480, 20);
  EXPECT_FALSE(f.of("camera_permission").empty());
}

TEST(DoctorCameras, aMediaControllersAdviceBecomesCommands) {
  FakeMachine f;
  f.camera("v4l2", "platform:unicam", "/dev/video0");
  f.inventory.drivers[0].cameras[0].media =
      "/dev/media0: ov9281 [0x2001/1280x800] ⇢ (off) unicam (/dev/video0)\n"
      "  the link is off: media-ctl -d /dev/media0 -l '\"ov9281\":0->\"unicam\":0[1]'\n"
      "  all of it: media-ctl -d /dev/media0 -p";
  EXPECT_EQ(f.of("media_chain")[0].state, FindingState::advice);
  f.need("v4l2", "platform:unicam", 1280, 800, 30);
  const Finding found = f.of("media_chain")[0];
  EXPECT_EQ(found.state, FindingState::problem);
  ASSERT_EQ(found.mend.size(), 1U);
  EXPECT_EQ(found.mend[0], "media-ctl -d /dev/media0 -l '\"ov9281\":0->\"unicam\":0[1]'");
  EXPECT_TRUE(contains(found.sentence, "; the link is off"));
  f.inventory.drivers[0].cameras[0].media =
      "/dev/media0: a → b\n  all of it: media-ctl -d /dev/media0 -p";
  EXPECT_EQ(f.of("media_chain")[0].state, FindingState::ok);
}

TEST(DoctorCameras, aDriverThatHangsIsAProblem) {
  FakeMachine f;
  f.inventory.drivers.push_back({"v4l2", "", false, {}, "no answer within 8 s"});
  EXPECT_EQ(f.of("cameras")[0].state, FindingState::problem);
}

TEST(DoctorUsb, theKernelsMemoryIsHeldAgainstTheTransfers) {
  FakeMachine f;
  f.need("iidc-usb", "", 1280, 960, 10);
  f.need("iidc-usb", "", 1280, 960, 10);
  f.file("/sys/module/usbcore/parameters/usbfs_memory_mb", "16\n");
  EXPECT_EQ(f.of("usb_memory")[0].state, FindingState::ok) << "9.4 MB";
  f.needs.cameras[1].bytes *= 4;
  EXPECT_EQ(f.of("usb_memory")[0].state, FindingState::problem);
  EXPECT_TRUE(
      mends_with(f.of("usb_memory")[0], "sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb"));
  f.file("/sys/module/usbcore/parameters/usbfs_memory_mb", "0\n");  // no limit
  EXPECT_EQ(f.of("usb_memory")[0].state, FindingState::ok);
}

TEST(DoctorUsb, camerasShareTheController) {
  FakeMachine f;
  for (const char* port : {"1-1", "1-2"}) f.usb(port, "1e10:2005", "");
  f.inventory.usb = list_usb_devices(f.machine);
  f.camera("iidc-usb", "A", "usb 001/001");
  f.camera("iidc-usb", "B", "usb 001/002");
  f.need("iidc-usb", "A", 640, 480, 30);
  f.need("iidc-usb", "B", 640, 480, 30);
  ASSERT_EQ(f.of("usb_bus").size(), 1U);
  EXPECT_EQ(f.of("usb_bus")[0].state, FindingState::ok);
  for (CameraNeed& n : f.needs.cameras) n.bytes *= 4;
  EXPECT_EQ(f.of("usb_bus")[0].state, FindingState::problem);
}

TEST(DoctorUsb, camerasMustNotSleep) {
  FakeMachine f;
  f.usb("1-1", "1e10:2005", "7");
  f.file("/sys/bus/usb/devices/1-1/power/control", "auto\n");
  f.usb("1-2", "1234:5678", "");
  f.file("/sys/bus/usb/devices/1-2/power/control", "auto\n");
  f.inventory.usb = list_usb_devices(f.machine);
  ASSERT_EQ(f.of("usb_sleep").size(), 1U) << "mice may";
  EXPECT_TRUE(mends_with(f.of("usb_sleep")[0],
                         "echo on | sudo tee /sys/bus/usb/devices/1-1/power/control"));
}

TEST(DoctorFirewire, theBudgetIsTheDriversOwn) {
  FakeMachine f;
  f.file("/sys/bus/firewire/devices/fw0/guid", "0x1");
  for (int k = 0; k < 2; ++k) f.need("iidc-1394", "", 1280, 960, 20);
  ASSERT_EQ(f.of("firewire_bus").size(), 1U);
  EXPECT_EQ(f.of("firewire_bus")[0].state, FindingState::problem)
      << "3076 bytes a packet at least: 2 x 3088 units at S400";
  EXPECT_TRUE(contains(f.of("firewire_bus")[0].sentence, "4915"));
  for (CameraNeed& n : f.needs.cameras) n.rate_hz = 15;
  EXPECT_EQ(f.of("firewire_bus")[0].state, FindingState::ok)
      << "2 x 2572 units in the fixed mode are too many, Format 7 does with less";
  EXPECT_TRUE(contains(f.of("firewire_bus")[0].sentence, "Format 7"));
  for (CameraNeed& n : f.needs.cameras) n.options = iidc::Options{.speed = iidc::BusSpeed::s800};
  EXPECT_EQ(f.of("firewire_bus")[0].state, FindingState::ok);
  EXPECT_TRUE(contains(f.of("firewire_bus")[0].sentence, "2572 of the bus's 4915"));
  EXPECT_FALSE(contains(f.of("firewire_bus")[0].sentence, "Format 7"));
  EXPECT_TRUE(f.of("firewire").empty());
}

TEST(DoctorFirewire, withoutAStackItSaysWhichModule) {
  FakeMachine f;
  f.need("iidc-1394", "", 640, 480, 15);
  EXPECT_TRUE(mends_with(f.of("firewire")[0], "sudo modprobe firewire-ohci"));
}

TEST(DoctorFirewire, anImageThatNeverFitsIsSaidToBeThat) {
  FakeMachine f;
  f.file("/sys/bus/firewire/devices/fw0/guid", "0x1");
  f.need("iidc-1394", "", 4000, 3000, 60);
  EXPECT_EQ(f.of("firewire_bus")[0].state, FindingState::problem);
}

TEST(Needs, aConfigurationBecomesBytesAndRates) {
  const Configuration c = parse_configuration(
      "cameras:\n  - {name: left, driver: v4l2, size: [640, 480], options: {thin: 3}}\n"
      "  - {name: right, driver: v4l2, size: [640, 480], pixel_format: GREY, serial: B}\ntrigger: "
      "{rate: 10}\n",
      "text", {});
  const Needs n = needs_of(c);
  ASSERT_EQ(n.cameras.size(), 2U);
  EXPECT_EQ(n.cameras[0].rate_hz, 30);
  EXPECT_EQ(n.cameras[0].bytes, 2 * 640 * 480);
  EXPECT_EQ(n.cameras[1].bytes, 640 * 480);
  EXPECT_EQ(n.cameras[1].serial, "B");
}

}  // namespace
}  // namespace vergence::app
