#pragma once
#include <gtest/gtest.h>

#include "drivers/gige/gige.hpp"
#include "tests/support/gige_camera.hpp"

namespace vergence::test {

/// One simulated camera and the driver's side of it.
struct GigeBench {
  explicit GigeBench(GigeCameraOptions options = {}, int k = 0) {
    options.address = GigeCamera::address(k);
    options.serial = "UNIT-" + std::to_string(k);
    if (options.sensor_width == 1280) {
      options.sensor_width = 320;
      options.sensor_height = 240;
    }
    simulator = std::make_unique<GigeCamera>(options);
    open();
  }
  void open() {
    DeviceStatus status = DeviceStatus::ok;
    const auto driver = gige::make_driver();
    camera = driver->open(simulator->options().address, &status);
    EXPECT_EQ(status, DeviceStatus::ok) << driver->last_error();
  }

  [[nodiscard]] CameraConfiguration wish() const {
    const GigeCameraOptions& o = simulator->options();
    return {o.sensor_width, o.sensor_height, 50, Duration::milliseconds(2), 0, CameraTrigger::free};
  }
  void configure(const CameraConfiguration& c) {
    ASSERT_EQ(camera->configure(c, nullptr), DeviceStatus::ok) << camera->last_error();
  }
  void start() { ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error(); }

  /// Until three frames have come.
  void stream() {
    configure(wish());
    start();
    EXPECT_EQ(read(3).size(), 3U);
  }

  /// Collects frames until `count` are complete or nothing comes for a second; all slots given
  /// back.
  std::vector<Frame> read(std::size_t count, Duration limit = Duration::seconds(1)) {
    std::vector<Frame> frames;
    const std::size_t before = numbers.size();
    for (Frame frame;
         numbers.size() - before < count && camera->wait(limit, &frame) == DeviceStatus::ok;) {
      if (frame.status == FrameStatus::complete) numbers.push_back(number(frame));
      camera->release(frame.slot);
      frames.push_back(frame);
    }
    return frames;
  }
  /// No more exposures; then what was on its way.
  std::vector<Frame> drain() {
    simulator->silence(true);
    return read(SIZE_MAX, Duration::milliseconds(400));
  }
  /// Frame number stored in the image.
  [[nodiscard]] std::uint64_t number(const Frame& frame) const {
    std::uint64_t n = 0;
    for (int i = 7; i >= 0; --i) n = n << 8U | camera->view(frame.slot).at(i, 0);
    return n;
  }
  [[nodiscard]] std::uint32_t reg(std::uint32_t address) const { return simulator->read(address); }

  std::unique_ptr<GigeCamera> simulator;
  std::unique_ptr<CameraDevice> camera;
  // Numbers of the complete frames.
  std::vector<std::uint64_t> numbers;
};

}  // namespace vergence::test
