// The V4L2 driver on the kernel's own test cameras, as a USB camera would be: webcam inputs, nobody
// at the far side.
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "drivers/v4l2/v4l2.hpp"
#include "tests/rigs/emulator.hpp"
#include "tests/rigs/vivid.hpp"
#include "tests/support/camera_options.hpp"

namespace vergence::v4l2 {
namespace {

using test::set_control;

/// Maximum wait for a frame or for the report of a disconnection.
constexpr Duration kSoon = Duration::seconds(2);

CameraConfiguration webcam() {
  CameraConfiguration c{640, 360, 25, Duration::milliseconds(8)};
  c.trigger = CameraTrigger::free;
  return c;
}

class V4l2Rig : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::inside_rig()) GTEST_SKIP() << test::kNeedsRig;
    for (const DeviceInfo& d : driver_->enumerate()) serials_.push_back(d.serial);
    ASSERT_EQ(serials_.size(), 2U) << "two test cameras";
  }
  std::unique_ptr<CameraDevice> open(std::size_t k) {
    DeviceStatus status = DeviceStatus::failed;
    auto camera = driver_->open(serials_.at(k), &status);
    EXPECT_EQ(status, DeviceStatus::ok);
    return camera;
  }
  std::unique_ptr<CameraDevice> streaming(std::size_t k, const CameraConfiguration& c = webcam()) {
    auto camera = open(k);
    EXPECT_EQ(camera->configure(c, nullptr), DeviceStatus::ok) << camera->last_error();
    EXPECT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
    return camera;
  }
  std::string node(std::size_t k) { return driver_->enumerate().at(k).place; }

  std::unique_ptr<CameraDriver> driver_ = make_driver();
  std::vector<std::string> serials_;
};

TEST_F(V4l2Rig, camerasAreListedAndOpenedBySerialOrPath) {
  EXPECT_NE(serials_[0], serials_[1]);
  DeviceStatus status = DeviceStatus::ok;
  const auto by_path = driver_->open("/dev/video1", &status);
  ASSERT_NE(by_path, nullptr);
  EXPECT_EQ(by_path->info().place, "/dev/video1");
  EXPECT_EQ(by_path->info().serial, serials_[1]) << "its own, which tells an exchanged one";
  const auto first = driver_->open("", &status);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->info().serial, serials_[0]);
  EXPECT_EQ(driver_->open("platform:nothing", &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::not_found);
  EXPECT_EQ(driver_->open("/dev/video77", &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::not_found);
  EXPECT_EQ(driver_->open("/dev/null", &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::unsupported);
  EXPECT_NE(driver_->last_error().find("/dev/null"), std::string::npos);
}

TEST_F(V4l2Rig, missingPermissionIsReportedWithTheGroup) {
  const std::string path = node(0);
  ASSERT_EQ(::setegid(65534), 0);
  ASSERT_EQ(::seteuid(65534), 0);
  DeviceStatus status = DeviceStatus::ok;
  const auto camera = driver_->open(path, &status);
  const std::string said = driver_->last_error();
  ASSERT_EQ(::seteuid(0), 0);
  ASSERT_EQ(::setegid(0), 0);
  EXPECT_EQ(camera, nullptr);
  EXPECT_EQ(status, DeviceStatus::no_permission);
  EXPECT_NE(said.find("group video"), std::string::npos) << said;
}

TEST_F(V4l2Rig, everyPixelFormatGivesTheSameGrey) {
  // The weights of colours do not matter on a ramp of grey.
  set_control(node(0), "test_pattern", 20);
  set_control(node(0), "osd_text_mode", 2);
  std::vector<std::uint8_t> reference;
  int formats = 0;
  for (const char* name : {"GREY", "NV12", "NV16", "YU12", "422P", "Y10", "Y12", "Y16", "YUYV",
                           "UYVY", "YVYU", "VYUY", "RGGB", "GRBG", "GBRG", "BA81"}) {
    CameraConfiguration c = webcam();
    c.pixel_format = name;
    auto camera = open(0);
    if (camera->configure(c, &c) != DeviceStatus::ok) {
      EXPECT_NE(camera->last_error().find("offers"), std::string::npos) << camera->last_error();
      continue;
    }
    EXPECT_EQ(c.pixel_format, name);
    ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << name << camera->last_error();
    Frame frame;
    ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok) << name;
    EXPECT_EQ(frame.status, FrameStatus::complete) << name;
    const ImageView view = camera->view(frame.slot);
    std::vector<std::uint8_t> row(view.row(200), view.row(200) + view.width);
    if (reference.empty()) reference = row;
    // Colour formats have black at 16 and white at 235 (ITU-R 601); each rounds by a level.
    const bool colour =
        std::set<std::string>{"GREY", "Y10", "Y12", "Y16", "RGGB", "GRBG", "GBRG", "BA81"}.count(
            name) == 0;
    for (std::size_t x = 0; x < row.size(); ++x)
      ASSERT_NEAR(row[x], colour ? 16 + reference[x] * 219.0 / 255 : reference[x], 2)
          << name << " at " << x;
    camera->release(frame.slot);
    ++formats;
  }
  EXPECT_GE(formats, 6) << "of those the test camera offers";
  EXPECT_GT(*std::max_element(reference.begin(), reference.end()) -
                *std::min_element(reference.begin(), reference.end()),
            200);
  set_control(node(0), "test_pattern", 0);
}

TEST_F(V4l2Rig, unsupportedSettingIsReportedWithTheOffer) {
  auto camera = open(0);
  using C = CameraConfiguration;
  for (const auto& [change, word] : {
           std::pair<void (*)(C*), const char*>{[](C* c) { c->width = 641; }, "640 x 360"},
           {[](C* c) { c->pixel_format = "Mono8"; }, "GREY"},
           {[](C* c) { c->trigger = CameraTrigger::hardware; }, "trigger"},
           {[](C* c) { c->trigger = CameraTrigger::software; }, "free"},
           {[](C* c) { test::give<v4l2::Options>(c, "control_nonsense", "1"); }, "brightness"},
           {[](C* c) { test::give<v4l2::Options>(c, "control_brightness", "256"); }, "0 to 255"},
           {[](C* c) { test::give<v4l2::Options>(c, "subdevice", "/dev/v4l-subdev9"); },
            "v4l-subdev9"},
           {[](C* c) { c->gain_db = 6; }, "gain_step_db"},
       }) {
    CameraConfiguration c = webcam();
    change(&c);
    EXPECT_EQ(camera->configure(c, nullptr), DeviceStatus::unsupported) << word;
    EXPECT_NE(camera->last_error().find(word), std::string::npos) << camera->last_error();
  }
  CameraConfiguration actual;
  EXPECT_EQ(camera->configure(webcam(), &actual), DeviceStatus::ok) << camera->last_error();
  EXPECT_EQ(actual.rate_hz, 25);
  EXPECT_NE(camera->remark().find("exposure"), std::string::npos)
      << "this camera has none that can be set";
}

TEST_F(V4l2Rig, unsupportedRateIsRoundedAndRemarked) {
  auto camera = open(0);
  CameraConfiguration c = webcam(), actual;
  c.rate_hz = 22;
  ASSERT_EQ(camera->configure(c, &actual), DeviceStatus::ok);
  EXPECT_EQ(actual.rate_hz, 25);
  EXPECT_NE(camera->remark().find("25 Hz"), std::string::npos) << camera->remark();
}

TEST_F(V4l2Rig, controlsAreSetByName) {
  auto camera = open(0);
  CameraConfiguration c = webcam();
  test::give<v4l2::Options>(&c, "control_brightness", "200");
  test::give<v4l2::Options>(&c, "control_test_pattern", "100% Black");
  test::give<v4l2::Options>(&c, "control_osd_text_mode", "None");
  ASSERT_EQ(camera->configure(c, nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok);
  Frame frame;
  ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok);
  EXPECT_NEAR(camera->view(frame.slot).at(320, 180), 200 - 128, 2) << "black, made brighter";
  camera->release(frame.slot);
  set_control(node(0), "brightness", 128);
}

TEST_F(V4l2Rig, startOfExposureStampsAreUnchanged) {
  // The test camera delivers at the start of a frame; the end of frame it stamps lies nine tenths
  // of a period later.
  const Duration exposure = Duration::milliseconds(8), later = Duration::milliseconds(36);
  Duration age[2];
  for (int source = 0; source < 2; ++source) {
    CameraConfiguration c = webcam();
    test::give<v4l2::Options>(&c, "control_timestamp_source",
                              source == 0 ? "End of Frame" : "Start of Exposure");
    auto camera = streaming(0, c);
    Frame frame;
    age[source] = Duration::seconds(1);
    for (int i = 0; i < 20; ++i) {
      ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok);
      age[source] = std::min(age[source],
                             Duration::nanoseconds(frame.arrival.ns() - frame.exposure_start.ns()));
      camera->release(frame.slot);
    }
  }
  set_control(node(0), "timestamp_source", 0);
  EXPECT_GE(age[1], Duration{}) << "as it is: before the arrival";
  EXPECT_NEAR((age[1] - age[0]).to_seconds(), (later - exposure).to_seconds(), 0.012)
      << "the exposure is taken off the end of frame";
}

TEST_F(V4l2Rig, silentCameraDisconnectsAndStreamsAgain) {
  auto camera = streaming(0);
  set_control(node(0), "percentage_of_dropped_buffers", 100);
  Frame frame;
  DeviceStatus status = DeviceStatus::timeout;
  // The loop waits 30 s at most.
  for (int i = 0; i < 300 && status != DeviceStatus::disconnected; ++i) {
    status = camera->wait(Duration::milliseconds(100), &frame);
    if (status == DeviceStatus::ok) camera->release(frame.slot);
  }
  EXPECT_EQ(status, DeviceStatus::disconnected);
  set_control(node(0), "percentage_of_dropped_buffers", 0);
  ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok);
  camera->release(frame.slot);
  EXPECT_EQ(camera->statistics().starts, 2U);
}

TEST_F(V4l2Rig, bufferWithErrorFlagIsIncomplete) {
  auto camera = streaming(0);
  Frame frame;
  ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok);
  camera->release(frame.slot);
  set_control(node(0), "inject_v4l2_buf_flag_error", 1);
  int incomplete = 0;
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok);
    incomplete += frame.status == FrameStatus::incomplete ? 1 : 0;
    camera->release(frame.slot);
  }
  EXPECT_EQ(incomplete, 1);
  EXPECT_EQ(camera->statistics().incomplete, 1U);
}

TEST_F(V4l2Rig, queueErrorDisconnectsUntilStart) {
  auto camera = streaming(0);
  Frame frame;
  ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok);
  const FrameSlot held = frame.slot;
  set_control(node(0), "inject_fatal_streaming_error", 1);
  DeviceStatus status = DeviceStatus::ok;
  while ((status = camera->wait(kSoon, &frame)) == DeviceStatus::ok) camera->release(frame.slot);
  ASSERT_EQ(status, DeviceStatus::disconnected);
  EXPECT_GT(frame.arrival.ns(), 0);
  ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  for (int i = 0; i < 40; ++i) {
    ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok);
    EXPECT_NE(frame.slot, held);
    camera->release(frame.slot);
  }
  camera->release(held);
}

TEST_F(V4l2Rig, cameraStreamedByAnotherProgramIsBusy) {
  const auto first = streaming(0);
  const auto second = open(0);
  EXPECT_EQ(second->configure(webcam(), nullptr), DeviceStatus::busy);
  EXPECT_NE(second->last_error().find("another program"), std::string::npos);
}

TEST_F(V4l2Rig, repeatedStopAndStartLeaksNoDescriptor) {
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
  };
  const auto before = open_files();
  {
    std::unique_ptr<CameraDevice> cameras[2] = {open(0), open(1)};
    for (auto& camera : cameras) ASSERT_EQ(camera->configure(webcam(), nullptr), DeviceStatus::ok);
    for (int i = 0; i < 15; ++i)
      for (auto& camera : cameras) {
        ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
        Frame frame;
        ASSERT_EQ(camera->wait(kSoon, &frame), DeviceStatus::ok);
        // Every second image is released only after the stop.
        if (i % 2 == 0) camera->release(frame.slot);
        camera->stop();
        if (i % 2 != 0) camera->release(frame.slot);
      }
  }
  EXPECT_EQ(open_files(), before);
}

}  // namespace
}  // namespace vergence::v4l2
