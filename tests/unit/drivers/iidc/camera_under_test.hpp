#pragma once
#include <gtest/gtest.h>

#include "drivers/iidc/iidc_camera.hpp"
#include "tests/support/camera_options.hpp"
#include "tests/unit/drivers/iidc/fake_bus.hpp"

namespace vergence::test {

constexpr Duration kPatience = Duration::milliseconds(50);

/// A camera on the register model.
struct CameraUnderTest {
  explicit CameraUnderTest(bool isochronous = false, bool beta = false) {
    auto made = std::make_unique<FakeBus>(isochronous, beta);
    bus = made.get();
    const iidc::ConfigRom rom = made->rom();
    camera = std::make_unique<iidc::IidcCamera>(std::move(made), rom, nullptr, kPatience);
  }
  /// 640 x 480 at 10 Hz of its own, 5 ms.
  [[nodiscard]] static CameraConfiguration usual() {
    return {640, 480, 10, Duration::milliseconds(5), 0, CameraTrigger::free};
  }

  void configure(const CameraConfiguration& c = usual()) {
    ASSERT_EQ(camera->configure(c, &actual), DeviceStatus::ok) << camera->last_error();
  }
  [[nodiscard]] static CameraConfiguration usual_with(const char* option, const char* value) {
    CameraConfiguration c = usual();
    test::give<iidc::Options>(&c, option, value);
    return c;
  }
  void start(const CameraConfiguration& c = usual()) {
    configure(c);
    ASSERT_EQ(camera->start(nullptr), DeviceStatus::ok) << camera->last_error();
  }
  /// The next frame, which must be there.
  Frame read() {
    Frame f;
    EXPECT_EQ(camera->wait(Duration{}, &f), DeviceStatus::ok);
    return f;
  }
  Frame read_and_release() {
    const Frame f = read();
    camera->release(f.slot);
    return f;
  }
  /// Returns the status of configure() and its message in *said.
  DeviceStatus refuse(const CameraConfiguration& c, std::string* said) {
    const DeviceStatus s = camera->configure(c, nullptr);
    *said = camera->last_error();
    return s;
  }

  FakeBus* bus = nullptr;
  std::unique_ptr<iidc::IidcCamera> camera;
  CameraConfiguration actual{};
};

/// A test of one USB camera, and of what it is asked for.
struct WithCamera : ::testing::Test {
  CameraUnderTest c;
  CameraConfiguration requested = CameraUnderTest::usual();
};

}  // namespace vergence::test
