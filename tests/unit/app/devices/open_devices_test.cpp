#include "app/devices/serial_devices.hpp"

#include "app/devices/camera_drivers.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/xsens_terminal.hpp"

namespace vergence::app {
namespace {

std::string refusal(const InsSettings& request) {
  std::vector<std::string> remarks;
  return test::refusal_of([&] { (void)open_ins(request, &remarks); });
}

InsSettings xsens_on(const std::string& port, double rate) {
  InsSettings r{.driver = "xsens", .port = port, .rate = rate};
  return r;
}

TEST(InsDrivers, terminalIsReadInRealTime) {
  for (const xbus::Generation generation : {xbus::Generation::legacy, xbus::Generation::mark4}) {
    test::DeviceOnTerminal terminal(test::resting_xsens({.generation = generation}));
    std::vector<std::string> remarks;
    const auto device = open_ins(xsens_on(terminal.port(), 120), &remarks);
    ASSERT_NE(device, nullptr);
    EXPECT_EQ(remarks.size(), generation == xbus::Generation::mark4 ? 1U : 0U)
        << "120 Hz are no rate of the newer one";
    EXPECT_EQ(refusal(xsens_on(terminal.port(), 120)).find("in use") == std::string::npos, false)
        << "the port is ours";
    ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
    std::vector<InsReading> all;
    for (InsReading r;
         all.size() < 60 && device->wait(Duration::seconds(5), &r) == DeviceStatus::ok;)
      all.push_back(r);
    ASSERT_EQ(all.size(), 60U);
    for (const InsReading& r : all) {
      EXPECT_EQ(r.sample.fix, FixStatus::fix_3d);
      // No converter is in between: a reading is here soon after it was measured.
      EXPECT_GT(r.arrival, r.host);
      EXPECT_LT(r.arrival - r.host, Duration::milliseconds(300)) << "a loaded machine";
    }
    device->stop();
  }
}

/// A missing device differs from a wrong request: scripts and the service tell them apart.

/// The message of the DeviceError that `open` throws.
template <class Open>
std::string device_error_of(const Open& open) {
  try {
    open();
  } catch (const DeviceError& e) {
    return e.what();
  }
  return "nothing is missing";
}

TEST(MissingDevices, absentCameraIsADeviceErrorOfEveryDriver) {
  for (const auto& [driver, serial] :
       {std::pair("gige", "NO-SUCH-CAMERA"), std::pair("gige", "127.77.77.77"),
        std::pair("v4l2", "/dev/video99"), std::pair("v4l2", "NO-SUCH-CAMERA"),
        std::pair("iidc-usb", "00b09d0123456789"), std::pair("iidc-1394", "00b09d0123456789")}) {
    Configuration c;
    c.cameras[0].driver = driver;
    c.cameras[0].serial = serial;
    std::vector<std::string> remarks;
    const std::string message = device_error_of([&] { (void)open_cameras(c, &remarks); });
    EXPECT_TRUE(test::mentions(message, "cameras.0", serial));
  }
}

TEST(MissingDevices, absentInsPortIsADeviceErrorOfEveryDriver) {
  for (const char* driver : {"xsens", "nmea", "ubx"}) {
    InsSettings request{.driver = driver, .port = "/dev/ttyNotThere"};
    std::vector<std::string> remarks;
    const std::string message = device_error_of([&] { (void)open_ins(request, &remarks); });
    EXPECT_TRUE(test::mentions(message, "/dev/ttyNotThere cannot be opened: not found")) << driver;
  }
}

TEST(MissingDevices, absentTriggerBoardIsADeviceError) {
  TriggerSettings settings;
  TriggerConfiguration pulses{.rate_hz = 30};
  std::vector<std::string> remarks;
  for (const char* port : {"/dev/ttyNotThere", "a serial number that no board has"}) {
    settings.port = port;
    const std::string message =
        device_error_of([&] { (void)open_trigger_board(settings, pulses, &remarks); });
    EXPECT_TRUE(test::mentions(message, "trigger: the trigger board on ", port));
  }
}

}  // namespace
}  // namespace vergence::app
