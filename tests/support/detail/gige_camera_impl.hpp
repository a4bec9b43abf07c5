#pragma once
#include <netinet/in.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/gige_camera.hpp"
#include "tests/support/gvsp_sender.hpp"

namespace vergence::test {

/// Bootstrap registers of GigE Vision, and the camera's memory.
namespace gvcp {
inline constexpr std::uint32_t kMemory = 0x40000,
                               kDescription = 0x20000;  // bytes; address of the description in it
inline constexpr std::uint32_t kHeartbeat = 0x938, kTicksHigh = 0x93C, kTicksLow = 0x940,
                               kLatch = 0x944, kLatchedHigh = 0x948, kControl = 0xA00,
                               kStreamPort = 0xD00, kPacketSize = 0xD04, kPacketDelay = 0xD08,
                               kStreamTarget = 0xD18;
inline constexpr std::uint32_t kSmallestPacket = 576, kLargestPacket = 16'000;  // bytes

[[nodiscard]] inline std::uint32_t from_wire(const std::uint8_t* p) {
  return static_cast<std::uint32_t>(p[0]) << 24U | static_cast<std::uint32_t>(p[1]) << 16U |
         static_cast<std::uint32_t>(p[2]) << 8U | p[3];
}
}  // namespace gvcp

/// Implementation of GigeCamera: gige_camera.cpp has its beginning and end, gige_camera_control.cpp
/// its registers, gige_camera_frames.cpp its exposures.
class GigeCamera::Impl {
 public:
  explicit Impl(const GigeCameraOptions& options);
  ~Impl();

  const GigeCameraOptions options;
  GvspSender sender;

  std::uint32_t get(std::uint32_t address) const {
    const std::lock_guard lock(mutex_);
    return word(address);
  }
  void set(std::uint32_t address, std::uint32_t value) {
    const std::lock_guard lock(mutex_);
    (void)store(address, value);
  }
  void power(bool on);
  void pulse(std::uint64_t number, std::uint32_t source, HostStamp when);
  void take_control(bool taken);
  std::uint64_t ticks(HostStamp host) const {
    if (options.tick_frequency == 0) return 0;
    const double f = static_cast<double>(options.tick_frequency) * 1e-9;
    const double ns =
        static_cast<double>(host.ns() - born_.ns()) * (1 + options.clock_drift_ppm * 1e-6);
    return static_cast<std::uint64_t>(
        std::llround((static_cast<double>(options.clock_offset_ns) + ns) * f));
  }
  bool acquiring() const {
    const std::lock_guard lock(mutex_);
    return acquiring_;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool silent_ = false;
  int lose_ = 0, tear_ = 0;
  int lie_width_ = 0, lie_height_ = 0;
  std::uint64_t starts_ = 0;

 private:
  void answer();
  void handle(int fd, const std::uint8_t* bytes, std::size_t length, const sockaddr_in& from);
  std::uint32_t write_registers(const std::uint8_t* payload, std::uint32_t length,
                                const sockaddr_in& from);
  std::uint32_t store(std::uint32_t address, std::uint32_t value);
  bool value_fits(std::uint32_t address, std::uint32_t value) const;
  void expose();
  GvspFrame make_frame(std::uint64_t number, HostStamp when);
  void follow_registers();
  [[nodiscard]] bool may_write(const sockaddr_in& from, std::uint32_t address) const;
  [[nodiscard]] std::uint32_t word(std::uint32_t address) const {
    return address + 4 <= gvcp::kMemory ? gvcp::from_wire(&memory_[address]) : 0;
  }
  [[nodiscard]] float real(std::uint32_t address) const {
    return std::bit_cast<float>(word(address));
  }
  [[nodiscard]] std::uint32_t payload() const;
  void put(std::uint32_t address, std::uint32_t value) {
    for (std::uint32_t i = 0; i < 4; ++i)
      memory_[address + i] = static_cast<std::uint8_t>(value >> (24U - 8U * i));
  }
  void put_text(std::uint32_t address, const std::string& text, std::size_t room) {
    std::memcpy(&memory_[address], text.data(), std::min(text.size(), room - 1));
  }
  void reset();

  std::vector<std::uint8_t> memory_;
  HostStamp born_{};
  int control_ = -1, broadcast_ = -1, wake_ = -1;
  bool quit_ = false, powered_ = true, acquiring_ = false, foreign_ = false;
  sockaddr_in controller_{};
  HostStamp heard_{};  // the controller's last word
  std::deque<std::pair<std::uint64_t, HostStamp>>
      pulses_;                   // triggers not yet served: the image's number, and when
  std::uint64_t triggered_ = 0;  // by software
  std::uint64_t block_ = 0;
  std::thread answering_, exposing_;
};

}  // namespace vergence::test
