#pragma once
#include <chrono>
#include <limits>
#include <memory>
#include <thread>

#include <fmt/format.h>

#include "tests/support/gige_camera.hpp"

namespace vergence::test {

/// Two simulated GigE Vision cameras for app/config/gige.yaml, and their trigger pulses.
class GigePair {
 public:
  /// Pixels of image `number` of a camera, which stay valid.
  using Images = std::function<const std::uint8_t*(std::size_t camera, std::uint64_t number)>;

  /// Serials are `serial`-0 and `serial`-1; `first_address`: see GigeCamera::address().
  GigePair(const std::string& serial, int first_address, int width, int height,
           const Images& images) {
    for (std::size_t k = 0; k < 2; ++k) {
      const int number = static_cast<int>(k);
      GigeCameraOptions o{.address = GigeCamera::address(first_address + number),
                          .serial = fmt::format("{}-{}", serial, k),
                          .sensor_width = width,
                          .sensor_height = height,
                          .clock_drift_ppm = 25.0 - 60.0 * number,
                          .discoverable = false,
                          .number_images = false};
      o.images = [images, k](std::uint64_t n) { return images(k, n); };
      cameras_[k] = std::make_unique<GigeCamera>(o);
    }
  }

  [[nodiscard]] GigeCamera& operator[](std::size_t k) const { return *cameras_[k]; }
  /// Words that name the cameras and their size to a command.
  [[nodiscard]] std::string settings() const {
    std::string words;
    for (std::size_t k = 0; k < 2; ++k) {
      const GigeCameraOptions& o = cameras_[k]->options();
      words += fmt::format(" --set cameras.{0}.serial={1} --set cameras.{0}.size=[{2},{3}]", k,
                           o.address, o.sensor_width, o.sensor_height);
    }
    return words;
  }
  void pulse(std::uint64_t number, HostStamp when) const {
    for (const auto& camera : cameras_) camera->pulse(number, when);
  }
  /// Pulses both cameras from 0.3 s after both stream on, until `count` or the thread's stop.
  [[nodiscard]] std::jthread pulses(
      double rate_hz, std::uint64_t count = std::numeric_limits<std::uint64_t>::max()) const {
    return std::jthread([this, rate_hz, count](const std::stop_token& stop) {
      using std::chrono::milliseconds, std::chrono::steady_clock;
      while (!stop.stop_requested() && !(cameras_[0]->acquiring() && cameras_[1]->acquiring()))
        std::this_thread::sleep_for(milliseconds(10));
      std::this_thread::sleep_for(milliseconds(300));
      for (std::uint64_t n = 0; n < count && !stop.stop_requested(); ++n) {
        pulse(n, HostStamp(steady_clock::now().time_since_epoch().count()));
        std::this_thread::sleep_for(std::chrono::duration<double>(1 / rate_hz));
      }
    });
  }

 private:
  std::array<std::unique_ptr<GigeCamera>, 2> cameras_;
};

}  // namespace vergence::test
