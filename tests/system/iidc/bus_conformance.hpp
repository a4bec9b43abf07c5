#pragma once
#include <chrono>

#include "tests/rigs/iidc_rig.hpp"
#include "tests/support/camera_options.hpp"
#include "tests/unit/drivers/conformance/camera_conformance.hpp"

namespace vergence::test {

/// One emulated camera on a real stack, for the conformance suite.
class BusConformance final : public ConformanceRig {
 public:
  BusConformance(std::unique_ptr<CameraDriver> driver, const std::string& program,
                 std::string unplug, std::string replug)
      : driver_(std::move(driver)), unplug_(std::move(unplug)), replug_(std::move(replug)) {
    // Waits until the cameras of the previous rig have disappeared.
    const bool none = await_cameras(driver_.get(), 0);
    emulator_ = std::make_unique<Emulator>(
        program, std::vector<std::string>{"--cameras", "1", "--trigger-hz", "20"});
    DeviceStatus status = DeviceStatus::not_found;
    // A node that was listed may be the one before, on its way out after a bus reset: looked for
    // again.
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(15);
    while (none && camera_ == nullptr && std::chrono::steady_clock::now() < until)
      if (await_cameras(driver_.get(), 1)) camera_ = driver_->open("", &status);
    if (camera_ == nullptr)
      throw std::runtime_error("the emulated camera does not open: " + driver_->last_error());
  }
  CameraDevice& camera() override { return *camera_; }
  std::vector<CameraConfiguration> possible() override {
    CameraConfiguration free{320, 240, 30, Duration::milliseconds(4), 0, CameraTrigger::free};
    test::give<iidc::Options>(&free, "buffers", "8");
    CameraConfiguration pulsed = free;
    pulsed.trigger = CameraTrigger::hardware;
    CameraConfiguration asked = free;
    asked.trigger = CameraTrigger::software;
    CameraConfiguration wide = free;
    wide.pixel_format = "Mono16";
    CameraConfiguration region = free;
    region.offset_x = 64;
    region.height = 120;
    return {free, pulsed, asked, wide, region};
  }
  std::vector<ExposureSetting> exposures() override {
    return {{Duration::milliseconds(2), 0}, {Duration::milliseconds(8), 6}};
  }
  std::vector<CameraConfiguration> impossible() override {
    std::vector<CameraConfiguration> all(6, possible().front());
    all[0].width = 321;
    all[1].gain_db = 60;
    all[2].exposure = Duration::microseconds(2);
    all[3].pixel_format = "Mono9";
    all[4].options = v4l2::Options{};
    all[5].offset_x = 1200;
    return all;
  }
  bool unplug() override {
    emulator_->command(unplug_);
    return true;
  }
  void replug() override { emulator_->command(replug_); }
  Duration disconnected_within() const override { return Duration::seconds(20); }
  bool lose(int exposures) override {
    emulator_->command("drop 0 " + std::to_string(exposures));
    return true;
  }
  bool content_fits(const Frame&, ImageView image) override {
    // All rows move on by one grey level an exposure; the number itself stands in row 0 of 8-bit
    // images only.
    for (int y = 2; y < image.height; ++y)
      for (const int x : {0, image.width - 1})
        if (image.at(x, y) != static_cast<std::uint8_t>(image.at(0, 1) + y - 1)) return false;
    return true;
  }

 private:
  std::unique_ptr<CameraDriver> driver_;
  std::unique_ptr<Emulator> emulator_;
  std::string unplug_, replug_;
  std::unique_ptr<CameraDevice> camera_;
};

}  // namespace vergence::test
