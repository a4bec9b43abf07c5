#pragma once
#include <atomic>
#include <cstdint>
#include <memory>

#include "drivers/serial/byte_line.hpp"

struct sp_port;

namespace vergence {

/// A descriptor that closes itself.
class UniqueFd {
 public:
  UniqueFd() noexcept = default;
  explicit UniqueFd(int fd) noexcept : fd_(fd) {}
  UniqueFd(UniqueFd&& o) noexcept : fd_(o.release()) {}
  UniqueFd& operator=(UniqueFd&& o) noexcept {
    if (this != &o) reset(o.release());
    return *this;
  }
  UniqueFd(const UniqueFd&) = delete;
  UniqueFd& operator=(const UniqueFd&) = delete;
  ~UniqueFd() { reset(-1); }
  [[nodiscard]] int get() const noexcept { return fd_; }
  [[nodiscard]] bool valid() const noexcept { return fd_ >= 0; }
  [[nodiscard]] int release() noexcept {
    const int fd = fd_;
    fd_ = -1;
    return fd;
  }
  void reset(int fd) noexcept;

 private:
  int fd_ = -1;
};

struct PortCloser {
  void operator()(sp_port* port) const noexcept;
};
using UniquePort = std::unique_ptr<sp_port, PortCloser>;

/// Bytes over a tty's descriptor, non-blocking, waiting in poll(). Opened through libserialport
/// (`port` set: the descriptor is the library's) or as a plain tty (`port` null: the descriptor is
/// its own).
class FdLine final : public ByteLine {
 public:
  /// Precondition: the descriptor is open, non-blocking and a raw tty at this baud; `wake` is an
  /// eventfd.
  FdLine(UniquePort port, UniqueFd tty, UniqueFd wake, const LineSettings& settings) noexcept;
  FdLine(const FdLine&) = delete;
  FdLine& operator=(const FdLine&) = delete;
  ~FdLine() override;

  LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept override;
  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration limit) noexcept override;
  DeviceStatus set_baud(std::uint32_t baud) noexcept override;
  std::uint32_t baud() const noexcept override { return settings_.baud; }
  void discard_input() noexcept override;
  void wake() noexcept override;
  HostStamp now() const noexcept override;

 private:
  UniquePort port_;
  UniqueFd tty_;
  UniqueFd wake_;
  int fd_;
  LineSettings settings_;
};

/// Sets a tty raw with these settings; what the system did is read back. → ok, unsupported, gone
[[nodiscard]] DeviceStatus set_raw_tty(int fd, const LineSettings& settings) noexcept;

/// The same through the library. → ok, unsupported, gone
[[nodiscard]] DeviceStatus set_port(sp_port* port, const LineSettings& settings) noexcept;

}  // namespace vergence
