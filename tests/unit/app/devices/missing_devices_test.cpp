#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "app/devices/camera_drivers.hpp"
#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"
#include "tests/support/temporary_folder.hpp"

/// What is not there is not what is wrongly asked for: scripts and the service tell them apart.
namespace vergence::app {
namespace {

enum class Refusal { none, input, device };

Refusal refusal_of(const std::function<void()>& open, std::string* sentence) {
  try {
    open();
  } catch (const InputError& e) {
    *sentence = e.what();
    return Refusal::input;
  } catch (const DeviceError& e) {
    *sentence = e.what();
    return Refusal::device;
  }
  return Refusal::none;
}

struct Absent {
  const char* driver;
  const char* serial;
};

class AbsentCamera : public ::testing::TestWithParam<Absent> {};

TEST_P(AbsentCamera, isADeviceError) {
  const CameraRequest request{"cameras.0",
                              GetParam().driver,
                              GetParam().serial,
                              PictureHalf::whole,
                              {320, 240, 30, Duration::milliseconds(2), 0, CameraTrigger::free}};
  std::string sentence;
  std::vector<std::string> remarks;
  EXPECT_EQ(refusal_of([&] { (void)open_cameras({request}, &remarks); }, &sentence),
            Refusal::device)
      << sentence;
  EXPECT_NE(sentence.find("cameras.0"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find(GetParam().serial), std::string::npos) << sentence;
}

INSTANTIATE_TEST_SUITE_P(OfEveryDriver, AbsentCamera,
                         ::testing::Values(Absent{"gige", "NO-SUCH-CAMERA"},
                                           Absent{"gige", "127.77.77.77"},
                                           Absent{"v4l2", "/dev/video99"},
                                           Absent{"v4l2", "NO-SUCH-CAMERA"},
                                           Absent{"iidc-usb", "00b09d0123456789"},
                                           Absent{"iidc-1394", "00b09d0123456789"}),
                         [](const auto& test) { return "case" + std::to_string(test.index); });

TEST(MissingDevices, aPortThatIsNotThereIsADeviceErrorOfEveryIns) {
  for (const std::string& driver : ins_driver_names()) {
    InsRequest request;
    request.driver = driver;
    request.port = "/dev/ttyNotThere";
    request.rate_hz = 100;
    std::string sentence;
    std::vector<std::string> remarks;
    EXPECT_EQ(refusal_of([&] { (void)open_ins(request, &remarks); }, &sentence), Refusal::device)
        << driver << ": " << sentence;
    EXPECT_NE(sentence.find("/dev/ttyNotThere cannot be opened: not found"), std::string::npos)
        << sentence;
  }
}

TEST(MissingDevices, aTriggerBoardThatIsNotThereIsADeviceError) {
  TriggerSettings settings;
  settings.port = "/dev/ttyNotThere";
  TriggerConfiguration pulses;
  pulses.rate_hz = 30;
  std::string sentence;
  std::vector<std::string> remarks;
  EXPECT_EQ(refusal_of([&] { (void)open_trigger_board(settings, pulses, &remarks); }, &sentence),
            Refusal::device)
      << sentence;
  EXPECT_NE(sentence.find("trigger: the board on /dev/ttyNotThere"), std::string::npos) << sentence;
  settings.port = "a serial number that no board has";
  EXPECT_EQ(refusal_of([&] { (void)open_trigger_board(settings, pulses, &remarks); }, &sentence),
            Refusal::device)
      << sentence;
}

}  // namespace
}  // namespace vergence::app
