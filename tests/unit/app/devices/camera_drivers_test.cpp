#include "app/devices/camera_drivers.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "app/devices/drive_sync.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

CameraRequest request(const std::string& driver, const std::string& serial) {
  return {"cameras.0",
          driver,
          serial,
          ImageHalf::whole,
          {320, 240, 30, Duration::milliseconds(2), 0, CameraTrigger::software}};
}

std::string refusal(const std::vector<CameraRequest>& requests) {
  std::vector<std::string> remarks;
  return test::refusal_of([&] { (void)open_cameras(requests, &remarks); });
}

test::GigeCameraOptions small(int k) {
  test::GigeCameraOptions o;
  o.address = test::GigeCamera::address(100 + k);
  o.serial = "TABLE-" + std::to_string(k);
  o.sensor_width = 320;
  o.sensor_height = 240;
  o.discoverable = false;
  return o;
}

TEST(CameraDrivers, whatACameraRefusesIsSaidWithItsName) {
  const test::GigeCamera simulator(small(0));
  CameraRequest r = request("gige", small(0).address);
  r.configuration.width = 640;
  const std::string message = refusal({r});
  EXPECT_NE(
      message.find(
          "cameras.0 (gige TABLE-0): Width 640 px is not possible: the camera offers 16 to 320 px"),
      std::string::npos)
      << message;
}

CameraRequest half(const std::string& key, ImageHalf which, const std::string& serial) {
  CameraRequest r = request("gige", serial);
  r.key = key;
  r.half = which;
  r.configuration.width = 160;
  return r;
}

TEST(CameraDrivers, entriesThatContradictEachOtherAreRefused) {
  const CameraRequest left = half("cameras.0", ImageHalf::left, "A");
  CameraRequest other = half("cameras.1", ImageHalf::right, "A");
  other.configuration.exposure = Duration::milliseconds(1);
  EXPECT_TRUE(test::mentions(refusal({request("gige", "A"), request("gige", "A")}), "two entries"));
  EXPECT_TRUE(test::mentions(refusal({left, half("cameras.1", ImageHalf::right, "B")}),
                             "cameras.0.image_half is left, and no other entry is the right half"));
  EXPECT_TRUE(test::mentions(refusal({left, other}), "cameras.0 and cameras.1 are halves"));
}

TEST(CameraDrivers, twoHalvesAreOneCamera) {
  const test::GigeCamera simulator(small(3));
  std::vector<std::string> remarks;
  const auto cameras = open_cameras({half("cameras.0", ImageHalf::right, small(3).address),
                                     half("cameras.1", ImageHalf::left, small(3).address)},
                                    &remarks);
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_NE(cameras[0].device->info().model.find("right half"), std::string::npos);
  EXPECT_NE(cameras[1].device->info().model.find("left half"), std::string::npos);
  for (const OpenedCamera& c : cameras) {
    EXPECT_EQ(c.actual.width, 160);
    ASSERT_EQ(c.device->start(nullptr), DeviceStatus::ok) << c.device->last_error();
  }
  ASSERT_EQ(cameras[1].device->trigger_once(), DeviceStatus::ok);
  std::array<Frame, 2> frames{};
  for (std::size_t k : {1U, 0U})
    ASSERT_EQ(cameras[k].device->wait(Duration::seconds(2), &frames[k]), DeviceStatus::ok);
  const ImageView right = cameras[0].device->view(frames[0].slot);
  const ImageView left = cameras[1].device->view(frames[1].slot);
  EXPECT_EQ(right.data, left.data + 160) << "columns of one picture";
  for (std::size_t k : {0U, 1U}) cameras[k].device->release(frames[k].slot);
}

TEST(SoftwareTrigger, everyCameraExposesAtEveryPulse) {
  const test::GigeCamera left(small(1)), right(small(2));
  std::vector<std::string> remarks;
  const auto cameras = open_cameras(
      {request("gige", small(1).address), request("gige", small(2).address)}, &remarks);
  std::vector<CameraDevice*> devices{cameras[0].device.get(), cameras[1].device.get()};
  SoftwareTrigger trigger(devices);
  EXPECT_EQ(trigger.start(nullptr), DeviceStatus::bad_configuration);
  EXPECT_EQ(trigger.configure({0}, nullptr), DeviceStatus::bad_configuration);
  ASSERT_EQ(trigger.configure({40}, nullptr), DeviceStatus::ok);
  for (CameraDevice* camera : devices)
    ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(trigger.start(nullptr), DeviceStatus::ok);
  for (std::uint64_t n = 0; n < 10; ++n) {
    Pulse pulse;
    ASSERT_EQ(trigger.wait(Duration::seconds(2), &pulse), DeviceStatus::ok);
    EXPECT_EQ(pulse.number, n);
    for (CameraDevice* camera : devices) {
      Frame frame;
      ASSERT_EQ(camera->wait(Duration::seconds(2), &frame), DeviceStatus::ok);
      EXPECT_EQ(frame.counter, n);
      camera->release(frame.slot);
    }
  }
  trigger.stop();
  Pulse pulse;
  while (trigger.wait(Duration{}, &pulse) == DeviceStatus::ok) {
  }
  EXPECT_EQ(trigger.wait(Duration::milliseconds(200), &pulse), DeviceStatus::stopped);
}

}  // namespace
}  // namespace vergence::app
