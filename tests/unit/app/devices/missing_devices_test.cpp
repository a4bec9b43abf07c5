#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "app/devices/camera_drivers.hpp"
#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"

/// A missing device differs from a wrong request: scripts and the service tell them apart.
namespace vergence::app {
namespace {

enum class Refusal { none, input, device };

Refusal refusal_of(const std::function<void()>& open, std::string* message) {
  try {
    open();
  } catch (const InputError& e) {
    *message = e.what();
    return Refusal::input;
  } catch (const DeviceError& e) {
    *message = e.what();
    return Refusal::device;
  }
  return Refusal::none;
}

TEST(MissingDevices, absentCameraIsADeviceErrorOfEveryDriver) {
  for (const auto& [driver, serial] :
       {std::pair("gige", "NO-SUCH-CAMERA"), std::pair("gige", "127.77.77.77"),
        std::pair("v4l2", "/dev/video99"), std::pair("v4l2", "NO-SUCH-CAMERA"),
        std::pair("iidc-usb", "00b09d0123456789"), std::pair("iidc-1394", "00b09d0123456789")}) {
    Configuration c;
    c.cameras[0].driver = driver;
    c.cameras[0].serial = serial;
    std::string message;
    std::vector<std::string> remarks;
    EXPECT_EQ(refusal_of([&] { (void)open_cameras(c, &remarks); }, &message), Refusal::device)
        << message;
    EXPECT_NE(message.find("cameras.0"), std::string::npos) << message;
    EXPECT_NE(message.find(serial), std::string::npos) << message;
  }
}

TEST(MissingDevices, absentInsPortIsADeviceErrorOfEveryDriver) {
  for (const char* driver : {"xsens", "nmea", "ubx"}) {
    InsSettings request;
    request.driver = driver;
    request.port = "/dev/ttyNotThere";
    std::string message;
    std::vector<std::string> remarks;
    EXPECT_EQ(refusal_of([&] { (void)open_ins(request, &remarks); }, &message), Refusal::device)
        << driver << ": " << message;
    EXPECT_NE(message.find("/dev/ttyNotThere cannot be opened: not found"), std::string::npos)
        << message;
  }
}

TEST(MissingDevices, absentTriggerBoardIsADeviceError) {
  TriggerSettings settings;
  settings.port = "/dev/ttyNotThere";
  TriggerConfiguration pulses;
  pulses.rate_hz = 30;
  std::string message;
  std::vector<std::string> remarks;
  EXPECT_EQ(refusal_of([&] { (void)open_trigger_board(settings, pulses, &remarks); }, &message),
            Refusal::device)
      << message;
  EXPECT_NE(message.find("trigger: the trigger board on /dev/ttyNotThere"), std::string::npos)
      << message;
  settings.port = "a serial number that no board has";
  EXPECT_EQ(refusal_of([&] { (void)open_trigger_board(settings, pulses, &remarks); }, &message),
            Refusal::device)
      << message;
}

}  // namespace
}  // namespace vergence::app
