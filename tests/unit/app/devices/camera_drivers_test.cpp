#include "app/devices/camera_drivers.hpp"

#include "app/devices/drive_sync.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

/// GigE cameras of 320 x 240 pixels with these serials.
Configuration gige(const std::vector<std::string>& serials) {
  Configuration c;
  for (std::size_t k = 0; k < serials.size(); ++k)
    c.cameras[k] = {.driver = "gige",
                    .serial = serials[k],
                    .width = 320,
                    .height = 240,
                    .trigger = CameraTrigger::software,
                    .exposure_us = 2000};
  c.trigger.rate = 30;
  return c;
}

std::string refusal(const Configuration& c) {
  std::vector<std::string> remarks;
  return test::refusal_of([&] { (void)open_cameras(c, &remarks); });
}

test::GigeCameraOptions small(int k) {
  return {.address = test::GigeCamera::address(100 + k),
          .serial = "TABLE-" + std::to_string(k),
          .sensor_width = 320,
          .sensor_height = 240,
          .discoverable = false};
}

TEST(CameraDrivers, impossibleSizeIsRefusedWithTheCamerasName) {
  const test::GigeCamera simulator(small(0));
  Configuration c = gige({small(0).address});
  c.cameras[0].width = 640;
  const std::string message = refusal(c);
  EXPECT_TRUE(test::mentions(
      message,
      "cameras.0 (gige TABLE-0): Width 640 px is not possible: the camera offers 16 to 320 px"));
}

/// Two entries for halves of images.
Configuration halves(const std::array<ImageHalf, 2>& which,
                     const std::vector<std::string>& serials) {
  Configuration c = gige(serials);
  for (std::size_t k = 0; k < 2; ++k) c.cameras[k].half = which[k], c.cameras[k].width = 160;
  return c;
}

TEST(CameraDrivers, contradictingEntriesAreRefused) {
  EXPECT_TRUE(test::mentions(refusal(gige({"A", "A"})), "two entries"));
  EXPECT_TRUE(test::mentions(refusal(halves({ImageHalf::left, ImageHalf::right}, {"A", "B"})),
                             "cameras.0.image_half is left, but no other entry is the right half"));
  Configuration other = halves({ImageHalf::left, ImageHalf::right}, {"A", "A"});
  other.cameras[1].exposure_us = 1000;
  EXPECT_TRUE(test::mentions(refusal(other), "cameras.0 and cameras.1 are halves"));
}

TEST(CameraDrivers, twoHalvesAreOneCamera) {
  const test::GigeCamera simulator(small(3));
  std::vector<std::string> remarks;
  const auto cameras = open_cameras(
      halves({ImageHalf::right, ImageHalf::left}, {small(3).address, small(3).address}), &remarks);
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
  const auto cameras = open_cameras(gige({small(1).address, small(2).address}), &remarks);
  std::vector<CameraDevice*> devices{cameras[0].device.get(), cameras[1].device.get()};
  const auto trigger = make_software_trigger(devices);
  EXPECT_EQ(trigger->start(nullptr), DeviceStatus::bad_configuration);
  EXPECT_EQ(trigger->configure({0}, nullptr), DeviceStatus::bad_configuration);
  ASSERT_EQ(trigger->configure({40}, nullptr), DeviceStatus::ok);
  for (CameraDevice* camera : devices)
    ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(trigger->start(nullptr), DeviceStatus::ok);
  for (std::uint64_t n = 0; n < 10; ++n) {
    Pulse pulse;
    ASSERT_EQ(trigger->wait(Duration::seconds(2), &pulse), DeviceStatus::ok);
    EXPECT_EQ(pulse.number, n);
    for (CameraDevice* camera : devices) {
      Frame frame;
      ASSERT_EQ(camera->wait(Duration::seconds(2), &frame), DeviceStatus::ok);
      EXPECT_EQ(frame.counter, n);
      camera->release(frame.slot);
    }
  }
  trigger->stop();
  Pulse pulse;
  while (trigger->wait(Duration{}, &pulse) == DeviceStatus::ok) {
  }
  EXPECT_EQ(trigger->wait(Duration::milliseconds(200), &pulse), DeviceStatus::stopped);
}

}  // namespace
}  // namespace vergence::app
