#include "app/devices/doctor_checks.hpp"

#include <functional>

#include <nlohmann/json.hpp>

#include "app/devices/inventory_report.hpp"
#include "tests/unit/app/devices/fake_machine.hpp"

namespace vergence::app {
namespace {

using test::FakeMachine;
using enum FindingState;

/// The host is 192.168.10.1/24.
constexpr std::uint32_t kHost = 0xC0A80A01U, kMask24 = 0xFFFFFF00U;
const std::string kLimits =
    "Max realtime priority     0                    0\n"
    "Max locked memory         8388608              8388608   bytes\n";

/// A GigE camera of 1280 x 960 at 30 Hz on eth1.
void put_gige(FakeMachine& f) {
  f.camera("gige", "15021234", "192.168.10.11");
  f.need("gige", "15021234");
  f.machine.addresses.push_back({"eth1", kHost, kMask24});
  f.file("/sys/class/net/eth1/mtu", "9000\n");
  f.file("/proc/sys/net/core/rmem_max", "10485760\n");
}
void put_video_node(FakeMachine& f) {
  f.file("/sys/class/video4linux/video0/index", "0");
  f.file("/dev/video0", "");
}
/// An INS on an FTDI converter at /dev/ttyUSB0, named `configured`; empty: no configuration.
void put_ins(FakeMachine& f, int latency_ms, const std::string& configured) {
  f.file("/dev/ttyUSB0", "");
  f.inventory.ports = {test::port(0x0403, 0x6001, "A1", latency_ms)};
  f.group = "dialout";
  f.given = !configured.empty();
  if (f.given) f.drive.ins.driver = "xsens";
  f.drive.ins.port = configured;
}

struct Case {
  const char* name;
  std::function<void(FakeMachine&)> set_up;
  const char* check;
  /// States of the findings of `check`, the worst first.
  std::string states;
  /// Part of the first finding's message or commands.
  std::string part = {};
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      // GigE
      {"buffer for eight images", put_gige, "receive_buffer", "ok"},
      {"buffer for three images",
       [](auto& f) { put_gige(f), f.file("/proc/sys/net/core/rmem_max", "4194304\n"); },
       "receive_buffer", "advice"},
      {"buffer below two images",
       [](auto& f) { put_gige(f), f.file("/proc/sys/net/core/rmem_max", "212992\n"); },
       "receive_buffer", "problem", "sudo sysctl -w net.core.rmem_max=10485760"},
      {"large images",
       [](auto& f) {
         put_gige(f), f.drive.cameras[0].width = 4000, f.drive.cameras[0].height = 3000;
       },
       "receive_buffer", "problem", "net.core.rmem_max=96000000"},
      {"jumbo packets", put_gige, "mtu", "ok"},
      {"small packets", [](auto& f) { put_gige(f), f.file("/sys/class/net/eth1/mtu", "1500\n"); },
       "mtu", "advice", "sudo ip link set dev eth1 mtu 9000"},
      {"camera in another network",
       [](auto& f) { put_gige(f), f.camera("gige", "2", "169.254.7.1"); }, "camera_network",
       "problem ok", "sudo ip addr add 169.254.7.2/16"},
      {"configured by an address that does not answer", [](auto& f) { f.need("gige", "10.9.9.9"); },
       "camera_network", "advice"},
      // Cameras
      {"one of two is missing",
       [](auto& f) {
         f.camera("v4l2", "A", "/dev/video0");
         f.need("v4l2", ""), f.need("v4l2", "B");
       },
       "cameras", "problem ok", "found: A"},
      {"a driver hangs",
       [](auto& f) {
         f.inventory.drivers.push_back({"v4l2", "", false, {}, "no answer"});
       },
       "cameras", "problem", "v4l2"},
      {"open node", put_video_node, "camera_permission", "ok"},
      {"not a member", [](auto& f) { put_video_node(f), f.closed = {"/dev/video0"}; },
       "camera_permission", "problem", "sudo usermod -aG video driver"},
      {"member, and closed all the same",
       [](auto& f) { put_video_node(f), f.closed = {"/dev/video0"}, f.machine.groups = {"video"}; },
       "camera_permission", "problem", "--write-udev"},
      {"a laptop's own camera",
       [](auto& f) { put_video_node(f), f.closed = {"/dev/video0"}, f.need("mock", ""); },
       "camera_permission", ""},
      // Serial ports
      {"latency of 16 ms", [](auto& f) { put_ins(f, 16, ""); }, "latency_timer", "ok"},
      {"latency of 1 ms", [](auto& f) { put_ins(f, 1, ""); }, "latency_timer", "advice",
       "echo 16 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer"},
      {"port named by any link",
       [](auto& f) {
         put_ins(f, 1, "/dev/vehicle/imu");
         f.file("/dev/vehicle/other", "");
         std::filesystem::create_symlink("../ttyUSB0", f.folder / "dev/vehicle/imu");
       },
       "latency_timer", "advice"},
      {"no port on USB", [](auto& f) { f.given = true, f.drive.ins.driver = "xsens"; }, "ins",
       "problem"},
      {"configured port is missing", [](auto& f) { put_ins(f, 16, "/dev/ttyUSB7"); }, "ins",
       "problem", "/dev/ttyUSB7"},
      {"closed port", [](auto& f) { put_ins(f, 16, "A1"), f.closed = {"/dev/ttyUSB0"}; },
       "serial_permission", "problem", "sudo usermod -aG dialout driver"},
      {"closed port of the board itself",
       [](auto& f) {
         put_ins(f, 16, "/dev/ttyUSB0"), f.inventory.ports.clear();
         f.closed = {"/dev/ttyUSB0"}, f.group = "tty";
       },
       "serial_permission", "problem", "serial-getty@"},
      {"port that the configuration does not name",
       [](auto& f) { put_ins(f, 16, ""), f.closed = {"/dev/ttyUSB0"}, f.given = true; },
       "serial_permission", ""},
      // System
      {"no priority is asked for", [](auto& f) { f.file("/proc/self/limits", kLimits); },
       "realtime", ""},
      {"priority is refused",
       [](auto& f) {
         f.file("/proc/self/limits", kLimits), f.given = true, f.drive.realtime.priority = 50;
       },
       "realtime", "problem", "driver - rtprio 50"},
      {"little memory may be locked",
       [](auto& f) {
         f.file("/proc/self/limits", kLimits), f.given = true, f.drive.realtime.lock_memory = 1;
       },
       "memory_lock", "advice"},
      {"clock in step", [](auto&) {}, "clock", "ok"},
      {"clock not in step", [](auto& f) { f.machine.clock_synchronised = false; }, "clock",
       "advice", "systemd-timesyncd"},
      {"room", [](auto&) {}, "disk", "ok"},
      {"1 GiB is left", [](auto& f) { f.room->bytes = std::uint64_t{1} << 30; }, "disk", "advice"},
      {"disk is full", [](auto& f) { f.room->bytes = 1000; }, "disk", "problem"},
      {"read-only disk", [](auto& f) { f.room->read_only = true; }, "disk", "problem"},
      {"closed folder", [](auto& f) { f.room->may_write = false, f.given = true; }, "disk",
       "problem"},
  };
  return all;
}

TEST(Doctor, findingsFollowTheMachine) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    FakeMachine f;
    c.set_up(f);
    const std::vector<Finding> found = f.of(c.check);
    std::string states;
    for (const Finding& finding : found)
      states += (states.empty() ? "" : " ") + std::string(to_string(finding.state));
    ASSERT_EQ(states, c.states);
    if (found.empty()) continue;
    std::string text = found[0].message;
    for (const std::string& command : found[0].fix) text += "\n" + command;
    EXPECT_TRUE(test::contains(text, c.part)) << text;
  }
}

TEST(Doctor, bareMachineHasNoProblem) {
  const FakeMachine f;
  const auto findings = run_checks(f.context());
  EXPECT_LE(findings.size(), 3U);
  for (const Finding& finding : findings) EXPECT_EQ(finding.state, ok) << finding.check;
}

TEST(Doctor, lastingBufferFileSortsAfterPackagesOwn) {
  FakeMachine f;
  put_gige(f);
  f.file("/proc/sys/net/core/rmem_max", "212992\n");
  const std::string name = std::filesystem::path(f.of("receive_buffer")[0].fix.back()).filename();
  int files = 0;
  for (const auto& file : std::filesystem::directory_iterator(VERGENCE_SOURCE_DIR "/packaging")) {
    if (file.path().extension() != ".conf") continue;
    ++files;
    EXPECT_GT(name, file.path().filename().string());
  }
  EXPECT_GT(files, 0);
}

TEST(Doctor, emptySerialMatchesUnnamedCamera) {
  FakeMachine f;
  f.camera("v4l2", "A", "/dev/video0");
  f.camera("v4l2", "B", "/dev/video2");
  f.need("v4l2", "");
  f.need("v4l2", "a");
  const auto matched = match_cameras(f.context());
  ASSERT_EQ(matched.size(), 2U);
  EXPECT_EQ(matched[0]->serial, "B");
  EXPECT_EQ(matched[1]->serial, "A");
}

using test::contains;

TEST(DoctorReport, commandsStayWholeAndControlCodesAreRemoved) {
  const std::string command = "sudo sysctl -w net.core.rmem_max=10485760 # longer than the line";
  const std::vector<Finding> findings{
      {"receive_buffer", FindingState::problem, "too little \033[2J", {command}},
      {"disk", FindingState::ok, "room", {}}};
  const std::string plain = doctor_text(findings, true);
  EXPECT_TRUE(contains(plain, command + "\n")) << plain;
  EXPECT_FALSE(contains(plain, "\033"));
  const auto json = nlohmann::json::parse(doctor_json(findings));
  EXPECT_EQ(json["problems"], 1);
  EXPECT_EQ(json["ok"], 1);
  EXPECT_EQ(json["findings"][0]["check"], "receive_buffer");
  EXPECT_EQ(json["findings"][0]["state"], "problem");
  EXPECT_EQ(json["findings"][0]["fix"].at(0), command);
}

TEST(DevicesReport, controlCodesOfDevicesAreRemoved) {
  Inventory i;
  i.ports = {test::port(0x0403, 0xD38B, "X\0337")};
  EXPECT_FALSE(contains(devices_text(i), "\033"));
}

TEST(DevicesReport, cameraLineIsYamlForAnySerial) {
  EXPECT_EQ(camera_line({"gige", "", "", "10.0.0.2"}), "{driver: gige, serial: \"10.0.0.2\"}");
  EXPECT_EQ(camera_line({"v4l2", "a\"b\\\n\xff", "", ""}),
            "{driver: v4l2, serial: \"a\\\"b\\\\\\n\\ufffd\"}");
}

}  // namespace
}  // namespace vergence::app
