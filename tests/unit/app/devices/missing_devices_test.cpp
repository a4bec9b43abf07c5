
#include <utility>
#include <vector>

#include "app/devices/camera_drivers.hpp"
#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"
#include "tests/support/mentions.hpp"

/// A missing device differs from a wrong request: scripts and the service tell them apart.
namespace vergence::app {
namespace {

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
