#include "tests/rigs/iidc_rig.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#ifdef __SANITIZE_THREAD__
/// libusb is not instrumented: its locks are seen, and the order they make is not.
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libusb-1.0.so\nrace:libusb-1.0.so\n";
}
#endif

namespace vergence::test {
namespace {

using std::chrono::steady_clock;

std::uint64_t little_endian(const std::uint8_t* p, int bytes) {
  std::uint64_t v = 0;
  for (int i = bytes; i > 0; --i) v = v << 8U | p[i - 1];
  return v;
}

}  // namespace

ImageStamp read_stamp(ImageView image) {
  const std::uint8_t* p = image.row(0) + 64;
  return {std::memcmp(p, "VRGF", 4) == 0, static_cast<std::uint32_t>(little_endian(p + 4, 4)),
          static_cast<std::int64_t>(little_endian(p + 8, 8)), little_endian(p + 16, 8)};
}

bool shows_pattern(ImageView image, std::uint32_t number) {
  for (int y = 1; y < image.height; ++y) {
    const auto grey = static_cast<std::uint8_t>(static_cast<std::uint32_t>(y) + number);
    const std::uint8_t* row = image.row(y);
    for (int x = 0; x < image.width; ++x)
      if (row[x] != grey) return false;
  }
  return true;
}

std::string emulated_serial(unsigned camera) { return "0205a9000000c00" + std::to_string(camera); }

CameraConfiguration usual(CameraTrigger trigger) {
  return {640, 480, 30, Duration::milliseconds(4), 0, trigger};
}

bool FrameCollector::read_one(std::size_t k, Duration limit) {
  Frame frame;
  if (cameras_[k]->wait(limit, &frame) != DeviceStatus::ok) return false;
  Account& a = accounts_[k];
  const ImageView image = cameras_[k]->view(frame.slot);
  const ImageStamp stamp = read_stamp(image);
  if (frame.status == FrameStatus::complete) {
    if (!stamp.valid ||
        stamp.guid != std::strtoull(cameras_[k]->info().serial.c_str(), nullptr, 16) ||
        !shows_pattern(image, stamp.number))
      ++a.wrong;
    ++a.complete;
    a.middles.push_back(stamp.middle_ns);
    a.starts.push_back(frame.exposure_start.ns());
  } else {
    ++a.incomplete;
  }
  if (counters_[k] >= 0) a.gaps += frame.counter - static_cast<std::uint64_t>(counters_[k]) - 1;
  counters_[k] = static_cast<std::int64_t>(frame.counter);
  cameras_[k]->release(frame.slot);
  return true;
}

bool FrameCollector::read(std::uint64_t frames, Duration limit) {
  const auto end = steady_clock::now() + std::chrono::nanoseconds(limit.ns());
  std::vector<std::uint64_t> left(cameras_.size(), frames);
  for (bool more = true; more;) {
    more = false;
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      if (left[k] > 0 && read_one(k, Duration::milliseconds(50))) --left[k];
      more = more || left[k] > 0;
    }
    if (steady_clock::now() > end) return !more;
  }
  return true;
}

void FrameCollector::drain(Duration quiet) {
  for (std::size_t k = 0; k < cameras_.size(); ++k)
    while (read_one(k, quiet)) {
    }
}

std::unique_ptr<CameraDevice> open_camera(CameraDriver* driver, unsigned camera,
                                          const CameraConfiguration& requested) {
  DeviceStatus status = DeviceStatus::failed;
  auto device = driver->open(emulated_serial(camera), &status);
  // After a bus reset the node that was listed may be on its way out: looked for again.
  for (int attempt = 0; device == nullptr && attempt < 50; ++attempt) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    device = driver->open(emulated_serial(camera), &status);
  }
  EXPECT_EQ(status, DeviceStatus::ok) << driver->last_error();
  if (device == nullptr) return device;
  EXPECT_EQ(device->configure(requested, nullptr), DeviceStatus::ok) << device->last_error();
  return device;
}

bool await_cameras(CameraDriver* driver, std::size_t count, Duration limit) {
  const auto end = steady_clock::now() + std::chrono::nanoseconds(limit.ns());
  while (driver->enumerate().size() != count) {
    if (steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return true;
}

bool start_again(CameraDevice* camera, Duration limit) {
  const auto end = steady_clock::now() + std::chrono::nanoseconds(limit.ns());
  while (camera->start(nullptr) != DeviceStatus::ok) {
    if (steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return true;
}

Holdings Holdings::now() {
  Holdings h;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd"))
    ++h.descriptors;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    if (line.find("/dev/") != std::string::npos) ++h.mappings;
  return h;
}

}  // namespace vergence::test
