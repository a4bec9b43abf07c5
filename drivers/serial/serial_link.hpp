#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/device.hpp"

namespace vergence {

/// Settings of a link with 8 data bits, no parity and no flow control.
struct LineSettings {
  std::uint32_t baud = 115200;
  /// 1 or 2.
  int stop_bits = 1;
};

/// Result of a read.
struct LineRead {
  DeviceStatus status = DeviceStatus::timeout;
  /// Number of bytes; 0 unless ok.
  std::size_t size = 0;
  /// If ok, upper bound of the arrival of the LAST of these bytes; if disconnected, the time of
  /// detection.
  HostStamp arrival{};
};

/// Open byte link to a device: a serial port, a plain tty or a simulator.
///
/// Ownership  Destruction closes it, without waiting for bytes that the device does not accept.
/// Threads    One thread each for read and write, or one for both. wake is thread-safe. The other
///            calls require that no read or write runs.
/// Memory     read, write and wake do not allocate.
/// Time       `arrival`, now() and limits are on the host's monotonic clock or a simulator's
///            virtual one, so a driver that uses now() runs alike in virtual time. No call exceeds
///            its limit, except for scheduling.
/// Errors     No call throws. After `disconnected` the link must be closed and another opened.
class SerialLink {
 public:
  virtual ~SerialLink() = default;

  /// Reads available bytes, waiting at most `limit` for the first (0: poll once).
  /// Precondition: `out` is not empty.
  /// → ok, timeout, stopped (woken), ended (a simulation is at its end), disconnected, failed
  [[nodiscard]] virtual LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept = 0;
  /// Writes all bytes; if not ok, some may have been sent. → ok, timeout, disconnected, failed
  [[nodiscard]] virtual DeviceStatus write(std::span<const std::uint8_t> bytes,
                                           Duration limit) noexcept = 0;
  /// Changes the rate and discards the input. → ok, unsupported, disconnected
  [[nodiscard]] virtual DeviceStatus set_baud(std::uint32_t baud) noexcept = 0;
  [[nodiscard]] virtual std::uint32_t baud() const noexcept = 0;
  virtual void discard_input() noexcept = 0;
  /// Makes the waiting or else the next read return `stopped` once.
  virtual void wake() noexcept = 0;
  [[nodiscard]] virtual HostStamp now() const noexcept = 0;
};

/// Factory for one link. open() may be called repeatedly, for example after a disconnect. Not
/// thread-safe. Allocates.
class SerialLinkFactory {
 public:
  virtual ~SerialLinkFactory() = default;
  /// Returns null on failure; *status has the reason. → ok, not_found, no_permission, busy,
  /// unsupported, failed
  [[nodiscard]] virtual std::unique_ptr<SerialLink> open(const LineSettings& settings,
                                                         DeviceStatus* status) = 0;
  /// Name for messages, as in `/dev/ttyUSB0`.
  [[nodiscard]] virtual std::string name() const = 0;
  /// Maximum time that a chip between device and host delays bytes (latency timer of a USB
  /// converter); 0 if none or unknown.
  [[nodiscard]] virtual Duration latency_timer() const { return {}; }
  /// In a simulation, lets this much virtual time pass with no open link. Returns false in real
  /// time; the caller then waits.
  [[nodiscard]] virtual bool pass(Duration /*time*/) { return false; }
};

}  // namespace vergence
