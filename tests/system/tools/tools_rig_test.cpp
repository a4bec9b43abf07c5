// `vergence devices`, `doctor` and `snap` on the kernel's real stacks: two cameras of each kind and
// an INS on an FTDI converter (tests/rigs/README.md).
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/rigs/emulator.hpp"
#include "tests/support/within.hpp"
#include "tests/support/xsens_terminal.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kWire = "/run/vergence-wire";
const std::string kConfigurations = std::string(VERGENCE_SOURCE_FOLDER) + "/app/config/";

json devices() {
  const Outcome o = run_vergence("devices --json");
  EXPECT_EQ(o.code, 0) << o.err;
  return json::parse(o.out);
}

std::size_t cameras_of(const json& all, const std::string& driver) {
  std::size_t n = 0;
  for (const json& c : all["cameras"]) n += c["driver"] == driver ? 1 : 0;
  return n;
}

/// The first finding of a check; null: none.
json finding(const std::string& arguments, const std::string& check) {
  const Outcome o = run_vergence("doctor --json " + arguments);
  const json all = json::parse(o.out);
  EXPECT_EQ(o.code, all["problems"] == 0 ? 0 : 1);
  for (const json& f : all["findings"])
    if (f["check"] == check) return f;
  return nullptr;
}

/// Types what the doctor printed; root needs no sudo.
void mend(const json& f) {
  std::string command = f["fix"].at(0);
  for (auto at = command.find("sudo "); at != std::string::npos; at = command.find("sudo "))
    command.erase(at, 5);
  EXPECT_EQ(std::system((command + " >/dev/null").c_str()), 0) << command;
}

class ToolsRig : public ::testing::Test {
 protected:
  ToolsRig() {
    // The converter of the test before is on its way out.
    EXPECT_TRUE(within(10, [] { return !fs::exists("/dev/ttyUSB0"); }));
    converter_ = std::make_unique<Emulator>("sim_ftdi", std::vector<std::string>{"--wire", kWire});
    EXPECT_TRUE(within(10, [] { return fs::exists("/dev/ttyUSB0"); }));
    sensor_ = std::make_unique<DeviceOnDescriptor>(::open(kWire, O_RDWR | O_NOCTTY | O_NONBLOCK),
                                                   resting_xsens());
    (void)std::system("udevadm settle --timeout=10");
  }
  std::unique_ptr<Emulator> converter_;
  std::unique_ptr<DeviceOnDescriptor> sensor_;
};

TEST_F(ToolsRig, everyConnectedDeviceIsListedOnce) {
  Emulator usb("sim_usb_iidc", {"--cameras", "2"});
  Emulator firewire("sim_1394", {"--cameras", "2"});
  json all;
  for (int i = 0; i < 20; ++i) {
    all = devices();
    if (cameras_of(all, "iidc-usb") == 2 && cameras_of(all, "iidc-1394") == 2) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  SCOPED_TRACE(all.dump(1));
  EXPECT_EQ(cameras_of(all, "iidc-usb"), 2U);
  EXPECT_EQ(cameras_of(all, "iidc-1394"), 2U);
  EXPECT_EQ(cameras_of(all, "v4l2"), 2U);
  ASSERT_GE(all["serial_ports"].size(), 1U);
  const json* converter = nullptr;
  for (const json& p : all["serial_ports"])
    if (p["port"] == "/dev/ttyUSB0") converter = &p;
  ASSERT_NE(converter, nullptr);
  EXPECT_EQ((*converter)["kind"], "ftdi");
  EXPECT_TRUE((*converter)["by_id"].get<std::string>().starts_with("/dev/serial/by-id/usb-FTDI"));
  EXPECT_TRUE((*converter)["latency_timer_ms"].is_number());
}

TEST_F(ToolsRig, writtenUdevRulesTakeEffect) {
  Emulator usb("sim_usb_iidc", {"--cameras", "1"});
  // The cameras of the previous test may still be listed, and this one may not be listed yet.
  std::size_t cameras = 0;
  for (int i = 0; i < 15 && cameras != 1; ++i) cameras = cameras_of(devices(), "iidc-usb");
  ASSERT_EQ(cameras, 1U);
  fs::create_directories("/run/udev/rules.d");
  ASSERT_EQ(run_vergence("devices --write-udev /run/udev/rules.d/98-vergence-rig.rules").code, 0);
  const std::string rules = read_file("/run/udev/rules.d/98-vergence-rig.rules");
  std::ofstream("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer") << 1 << std::flush;
  ASSERT_EQ(std::system("udevadm control --reload && udevadm trigger --action=add && udevadm "
                        "settle --timeout=20"),
            0);
  std::size_t names = 0;
  for (const auto& entry : fs::directory_iterator("/dev/vergence")) {
    (void)entry;
    ++names;
  }
  EXPECT_GE(names, 2U) << rules;
  EXPECT_EQ(read_file("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer").substr(0, 2), "16")
      << rules;
  std::size_t awake = 0;
  for (const auto& device : fs::directory_iterator("/sys/bus/usb/devices"))
    if (fs::exists(device.path() / "idVendor") &&
        read_file(device.path() / "idVendor").starts_with("1e10"))
      awake += read_file(device.path() / "power/control").starts_with("on") ? 1 : 0;
  EXPECT_EQ(awake, 1U) << rules;
}

TEST_F(ToolsRig, rigRulesNamePortAfterItsConfiguredDevice) {
  const TemporaryFolder folder;
  fs::create_directories("/run/udev/rules.d");
  const auto linked_as = [&](const std::string& group, const std::string& driver) {
    const auto rig = folder.write("rig.yaml", group + ": {driver: " + driver +
                                                  ", port: /dev/ttyUSB0}\n"
                                                  "cameras: [{name: left, driver: gige}]\n");
    const Outcome o = run_vergence("devices --rig '" + rig.string() +
                                   "' --write-udev /run/udev/rules.d/98-vergence-rig.rules");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(std::system("udevadm control --reload && udevadm trigger --action=add && udevadm "
                          "settle --timeout=20"),
              0);
    for (const auto& entry : fs::directory_iterator("/dev/vergence"))
      if (entry.path().filename().string().starts_with(group + "-"))
        return fs::canonical(entry.path()).string();
    return std::string("nothing");
  };
  EXPECT_EQ(linked_as("ins", "xsens"), "/dev/ttyUSB0");
  EXPECT_EQ(linked_as("trigger", "board"), "/dev/ttyUSB0");
  fs::remove("/run/udev/rules.d/98-vergence-rig.rules");
}

TEST_F(ToolsRig, doctorFixForLatencyTimerWorks) {
  Emulator usb("sim_usb_iidc", {"--cameras", "2"});
  std::ofstream("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer") << 1 << std::flush;
  const json slow = finding("", "latency_timer");
  ASSERT_EQ(slow["state"], "advice") << slow;
  mend(slow);
  EXPECT_EQ(finding("", "latency_timer")["state"], "ok");
}

}  // namespace
}  // namespace vergence::test
