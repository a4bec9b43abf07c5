#pragma once
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "app/devices/camera_drivers.hpp"
#include "drivers/acquisition/acquisition.hpp"
#include "drivers/gige/detail/link.hpp"
#include "tests/support/camera_options.hpp"
#include "tests/support/gige_camera.hpp"

namespace vergence::test {

/// Empty: a socket may hold enough here. Else the sentence to skip with.
inline std::string socket_buffer_obstacle() {
  constexpr std::int64_t kEnough = 2 << 20;  // bytes: two images of 1280 x 960 and some
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const std::int64_t got = fd < 0 ? 0 : gige::set_receive_buffer(fd, kEnough);
  if (fd >= 0) (void)::close(fd);
  return got >= kEnough
             ? ""
             : "receive buffers are too small here: sudo sysctl -w net.core.rmem_max=10485760";
}

/// Two simulated cameras on one pulse, driver, pairing: numbers of the pairs that came out
/// complete.
class Pairs {
 public:
  static constexpr int kWidth = 640, kHeight = 480;

  Pairs(const char* resend, double loss, double rate, int count) : rate_(rate) {
    std::vector<app::CameraRequest> requests;
    for (int k = 0; k < 2; ++k) {
      GigeCameraOptions o;
      o.address = GigeCamera::address(k);
      o.serial = "PAIR-" + std::to_string(k);
      o.sensor_width = kWidth;
      o.sensor_height = kHeight;
      o.seed = static_cast<std::uint64_t>(k) + 5;
      o.clock_drift_ppm = k == 0 ? 40 : -35;
      o.clock_offset_ns = 1'000'000'000'000 * (k + 3);
      o.discoverable = false;
      simulators.push_back(std::make_unique<GigeCamera>(o));
      app::CameraRequest r{"cameras." + std::to_string(k),
                           "gige",
                           o.address,
                           app::PictureHalf::whole,
                           {kWidth, kHeight, rate, Duration::milliseconds(2), 0}};
      give<gige::Options>(&r.configuration, "packet_size", "16000");
      give<gige::Options>(&r.configuration, "resend", resend);
      requests.push_back(std::move(r));
    }
    std::vector<std::string> remarks;
    cameras = app::open_cameras(requests, &remarks);
    Acquisition::Options o;
    o.sync.interval = Duration::seconds(1 / rate);
    o.sync.align_start = true;
    source = std::make_unique<Acquisition>(
        std::vector<CameraDevice*>{cameras[0].device.get(), cameras[1].device.get()}, nullptr,
        nullptr, o);
    EXPECT_FALSE(source->start());
    std::thread pulses([this, loss, count] {
      constexpr int kQuiet = 5;  // pulses at either end without loss: the first frame sets the
                                 // count, the last shows the gap before it
      pulse(0, kQuiet);
      for (const auto& s : simulators) s->set_loss(loss);
      pulse(kQuiet, count - kQuiet);
      for (const auto& s : simulators) s->set_loss(0);
      pulse(count - kQuiet, count);
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      source->stop();
    });
    for (Acquired item; source->next(&item);) {
      const auto* frame = std::get_if<AcquiredFrame>(&item);
      if (frame == nullptr) continue;
      take(frame->rig);
      source->release(*frame);
    }
    pulses.join();
    source->join();
  }

  /// Pulses of which both cameras sent their image whole.
  [[nodiscard]] std::vector<std::uint64_t> whole() const {
    const auto left = simulators[0]->whole(), right = simulators[1]->whole();
    std::vector<std::uint64_t> both;
    std::set_intersection(left.begin(), left.end(), right.begin(), right.end(),
                          std::back_inserter(both));
    return both;
  }

  std::vector<std::unique_ptr<GigeCamera>> simulators;
  std::vector<app::OpenedCamera> cameras;
  std::unique_ptr<Acquisition> source;
  std::vector<std::uint64_t> complete;

 private:
  void pulse(int from, int to) {
    const auto period = std::chrono::nanoseconds(Duration::seconds(1 / rate_).ns());
    auto due = std::chrono::steady_clock::now();
    for (int n = from; n < to; ++n) {
      const HostStamp now(std::chrono::steady_clock::now().time_since_epoch().count());
      for (const auto& s : simulators) s->pulse(static_cast<std::uint64_t>(n), now);
      std::this_thread::sleep_until(due += period);
    }
  }
  void take(const RigFrame& frame) {
    std::uint64_t numbers[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
      const ImageView& image = frame.images[static_cast<std::size_t>(k)];
      if (image.empty()) return;
      for (int i = 7; i >= 0; --i) numbers[k] = numbers[k] << 8U | image.at(i, 0);
    }
    EXPECT_EQ(numbers[0], numbers[1]) << "images of two pulses in one set";
    complete.push_back(numbers[0]);
  }
  double rate_;
};

}  // namespace vergence::test
