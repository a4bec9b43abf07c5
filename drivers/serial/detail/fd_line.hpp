#pragma once
#include <cstdint>

#include "drivers/serial/serial_link.hpp"
#include "drivers/unique_fd.hpp"

namespace vergence {

/// Link over a tty's non-blocking descriptor, waiting in poll().
class FdLine final : public SerialLink {
 public:
  /// Precondition: the descriptor is open, non-blocking and a raw tty at this baud; `wake` is an
  /// eventfd.
  FdLine(UniqueFd tty, UniqueFd wake, const LineSettings& settings) noexcept;
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
  UniqueFd tty_;
  UniqueFd wake_;
  LineSettings settings_;
};

/// Sets a tty raw with these settings; what the system did is read back. → ok, unsupported,
/// disconnected
[[nodiscard]] DeviceStatus set_raw_tty(int fd, const LineSettings& settings) noexcept;

}  // namespace vergence
