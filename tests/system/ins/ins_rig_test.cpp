// A simulated XSens INS at the far end of an emulated FTDI converter, behind the kernel's ftdi_sio
// and libserialport.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "drivers/serial/serial.hpp"
#include "drivers/xsens/xsens.hpp"
#include "tests/rigs/emulator.hpp"
#include "tests/support/within.hpp"
#include "tests/support/xsens_terminal.hpp"

namespace vergence {
namespace {

using test::within;

constexpr const char* kPort = "/dev/ttyUSB0";
constexpr const char* kWire = "/run/vergence-wire";

std::vector<InsReading> readings(InsDevice& device, std::size_t most) {
  std::vector<InsReading> all;
  for (InsReading r;
       all.size() < most && device.wait(Duration::seconds(10), &r) == DeviceStatus::ok;)
    all.push_back(r);
  return all;
}

void expect_whole(const std::vector<InsReading>& all, std::size_t count) {
  ASSERT_EQ(all.size(), count);
  for (std::size_t i = 1; i < all.size(); ++i) {
    ASSERT_EQ(all[i].sample.number, all[i - 1].sample.number + 1) << "none is lost";
    ASSERT_GT(all[i].host, all[i - 1].host);
    ASSERT_GT(all[i].arrival, all[i].host);
    ASSERT_EQ(all[i].sample.fix, FixStatus::fix_3d);
  }
}

class InsRig : public ::testing::Test {
 protected:
  InsRig() : converter_("sim_ftdi", {"--wire", kWire}) {
    EXPECT_TRUE(within(10, [] { return std::filesystem::exists(kPort); }));
    sensor_ = std::make_unique<test::DeviceOnDescriptor>(
        ::open(kWire, O_RDWR | O_NOCTTY | O_NONBLOCK), test::resting_xsens());
  }
  std::unique_ptr<InsDevice> open(std::uint32_t baud) {
    xsens::Options o;
    o.baud = baud;
    DeviceStatus status = DeviceStatus::ok;
    const auto driver = xsens::make_driver(o);
    // The converter is the only one.
    auto device = driver->open("", &status);
    EXPECT_EQ(status, DeviceStatus::ok) << driver->last_error();
    return device;
  }
  static void set_latency_timer(int ms) {
    std::ofstream("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer") << ms << std::flush;
    EXPECT_EQ(read_latency_timer_ms(kPort), ms);
  }

  test::Emulator converter_;
  std::unique_ptr<test::DeviceOnDescriptor> sensor_;
};

TEST_F(InsRig, samplesAreCompleteWithEitherLatencyTimer) {
  const auto ports = list_serial_ports();
  const auto port = std::find_if(ports.begin(), ports.end(),
                                 [](const SerialPortInfo& p) { return p.port == kPort; });
  ASSERT_NE(port, ports.end());
  EXPECT_EQ(port->usb_vendor, 0x0403);
  EXPECT_EQ(port->usb_serial, "VG000001");
  EXPECT_EQ(port->latency_timer_ms, 16);
  for (const int timer : {16, 1}) {
    set_latency_timer(timer);
    const auto device = open(921600);
    ASSERT_NE(device, nullptr);
    DeviceStatus status = DeviceStatus::ok;
    EXPECT_EQ(SerialPort(kPort).open({}, &status), nullptr);
    EXPECT_EQ(status, DeviceStatus::busy) << "the line is ours";
    ASSERT_EQ(device->configure(100, nullptr), DeviceStatus::ok) << device->last_error();
    ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
    expect_whole(readings(*device, 300), 300);
    EXPECT_EQ(device->statistics().malformed, 0U);
    device->stop();
  }
}

TEST_F(InsRig, reconnectsAfterConverterWasUnplugged) {
  const auto device = open(115200);
  ASSERT_NE(device, nullptr);
  ASSERT_EQ(device->configure(100, nullptr), DeviceStatus::ok) << device->last_error();
  ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
  expect_whole(readings(*device, 100), 100);
  converter_.command("unplug");
  DeviceStatus status = DeviceStatus::ok;
  InsReading r;
  ASSERT_TRUE(within(10, [&] {
    do status = device->wait(Duration{}, &r);
    while (status == DeviceStatus::ok);
    return status == DeviceStatus::disconnected;
  }));
  EXPECT_EQ(device->start(nullptr), DeviceStatus::disconnected)
      << "not back, and start() does not wait for it";
  converter_.command("replug");
  ASSERT_TRUE(within(30, [&] { return device->start(nullptr) == DeviceStatus::ok; }));
  expect_whole(readings(*device, 100), 100);
  device->stop();
}

}  // namespace
}  // namespace vergence
