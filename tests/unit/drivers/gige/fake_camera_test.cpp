#include <arv.h>
#include <gtest/gtest.h>

#include "drivers/gige/detail/glib.hpp"
#include "drivers/gige/gige.hpp"
#include "tests/support/camera_options.hpp"

namespace vergence {
namespace {

/// Aravis's own simulated camera, of which nothing here is by the same hand as the driver: older
/// names, no resend, no test packet.
TEST(GigeFakeCamera, configuresAndStreams) {
  const gige::Object<ArvGvFakeCamera> fake(arv_gv_fake_camera_new("127.0.0.1", "FAKE-1"));
  if (fake == nullptr || arv_gv_fake_camera_is_running(fake.get()) == FALSE)
    GTEST_SKIP() << "needs UDP port 3956 of 127.0.0.1: stop the program that uses it";
  DeviceStatus status = DeviceStatus::ok;
  const auto driver = gige::make_driver();
  const auto camera = driver->open("127.0.0.1", &status);
  ASSERT_NE(camera, nullptr) << to_string(status) << driver->last_error();
  CameraConfiguration c{256, 200, 40, Duration::milliseconds(3), 0, CameraTrigger::free};
  test::give<gige::Options>(&c, "packet_size", "1400");
  ASSERT_EQ(camera->configure(c, nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  Frame frame;
  // The ids wrap after 135.
  for (std::uint64_t n = 0; n < 150; ++n) {
    ASSERT_EQ(camera->wait(Duration::seconds(2), &frame), DeviceStatus::ok)
        << n << camera->last_error();
    EXPECT_EQ(frame.status, FrameStatus::complete);
    EXPECT_EQ(frame.counter, n);
    camera->release(frame.slot);
  }
  EXPECT_EQ(camera->statistics().lost, 0U);
  camera->stop();
  c.trigger = CameraTrigger::software;
  ASSERT_EQ(camera->configure(c, nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(camera->trigger_once(), DeviceStatus::ok) << camera->last_error();
  EXPECT_EQ(camera->wait(Duration::seconds(2), &frame), DeviceStatus::ok);
}

}  // namespace
}  // namespace vergence
