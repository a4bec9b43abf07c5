#include "app/devices/exposure_control.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "tests/support/idle_camera.hpp"

namespace vergence::app {
namespace {

constexpr int kWidth = 96, kHeight = 64;

/// Answers as told, after a while.
class SlowCamera final : public test::IdleCamera {
 public:
  ImageView view(FrameSlot) const noexcept override {
    return {pixels_.data(), kWidth, kHeight, kWidth};
  }
  DeviceStatus set_exposure(const ExposureSetting& requested,
                            ExposureSetting* actual) noexcept override {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    asked.fetch_add(1);
    if (answer.load() == DeviceStatus::ok) *actual = requested;
    return answer.load();
  }
  void expose_for(ExposureControl* control) {
    Frame frame{.exposure = has.exposure, .gain_db = has.gain_db};
    control->on_frame(0, frame);
  }
  void show(double grey) { std::fill(pixels_.begin(), pixels_.end(), std::uint8_t(grey)); }

  ExposureSetting has{};
  std::atomic<int> asked{0};
  std::atomic<DeviceStatus> answer{DeviceStatus::ok};

 private:
  /// The image is dark.
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(kWidth * kHeight, 10);
};

TEST(ExposureControl, slowCameraDoesNotDelayFrames) {
  SlowCamera camera;
  const ExposureSetting start{Duration::microseconds(1000), 0};
  camera.has = start;
  ExposureControl control({&camera}, kWidth, kHeight, {}, {}, start, false);
  const auto begun = std::chrono::steady_clock::now();
  for (int i = 0; i < 500; ++i) {
    camera.expose_for(&control);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(290))
      << "500 looks; one answer takes 300 ms";
  EXPECT_EQ(control.counters().changes, 1U) << "nothing more is asked while the camera is at it";
  control.settle();
}

TEST(ExposureControl, unableCameraEndsItForgetfulOneIsAskedAgain) {
  const ExposureSetting start{Duration::microseconds(1000), 0};
  SlowCamera unable;
  unable.has = start;
  unable.answer = DeviceStatus::unsupported;
  ExposureControl control({&unable}, kWidth, kHeight, {}, {}, start, true);
  for (int i = 0; i < 100; ++i) unable.expose_for(&control);
  EXPECT_EQ(unable.asked, 1);
  EXPECT_TRUE(control.counters().unsupported);

  exposure::ExposureOptions options{.target = 20};
  // Ten grey levels are within a stop of 20.
  options.dead_band = 1;
  // Another exposure than it was given, or another gain alone.
  for (const ExposureSetting& has : {ExposureSetting{Duration::microseconds(100), 0},
                                     ExposureSetting{Duration::microseconds(1000), 6}}) {
    SlowCamera forgetful;
    forgetful.has = has;
    ExposureControl again({&forgetful}, kWidth, kHeight, {}, options, start, true);
    for (int i = 0; i < 4 * options.settle_frames; ++i) forgetful.expose_for(&again);
    EXPECT_EQ(forgetful.asked, 1);
    EXPECT_EQ(again.counters().again, 1U);
  }
}

TEST(ExposureControl, changeWhileDisconnectedIsRepeatedOnReturn) {
  const ExposureSetting start{Duration::microseconds(1000), 0};
  // The image is dark, so a longer exposure is requested.
  SlowCamera camera;
  camera.has = start;
  camera.answer = DeviceStatus::disconnected;
  exposure::ExposureOptions options;
  ExposureControl control({&camera}, kWidth, kHeight, {}, options, start, true);
  const auto look = [&] { camera.expose_for(&control); };
  while (camera.asked == 0) look();
  camera.answer = DeviceStatus::ok;
  // No further change is needed.
  camera.show(options.target);
  for (int i = 0; i < 8 * options.settle_frames && camera.asked == 1; ++i) look();
  EXPECT_EQ(camera.asked, 2);
  EXPECT_EQ(control.counters().again, 1U);
}

}  // namespace
}  // namespace vergence::app
