#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "drivers/device.hpp"

namespace vergence {

/// Settings of a link: 8 data bits, no parity, no flow control, and these.
struct LineSettings {
  std::uint32_t baud = 115200;
  int stop_bits = 1;  // 1 or 2
};

/// Result of a read.
struct LineRead {
  DeviceStatus status = DeviceStatus::timeout;
  std::size_t size = 0;  // bytes; 0 unless ok
  HostStamp arrival{};   // ok: when the LAST of these bytes was here, never earlier than it was;
                         // gone: when that was noticed
};

/// An open line to a device that sends and takes bytes: a serial port, a plain tty or a
/// simulator.
///
/// Ownership  One owner, who closes it by destruction; closing does not wait for bytes that a dead
///            device will never take.
/// Threads    read and write: one thread each, the same or two. wake: any. The rest: while no read
///            or write runs.
/// Memory     read, write and wake do not allocate.
/// Time       `arrival` and now() are of the host's monotonic clock, or of the virtual one that a
///            simulator keeps. All limits are of that
///            clock: a driver that reckons in now() runs the same in virtual time. No call outlasts
///            its limit but for the scheduler.
/// Errors     Nothing throws. `disconnected` stays: close it and open another.
class SerialLink {
 public:
  virtual ~SerialLink() = default;

  /// Reads available bytes, waiting at most `limit` for the first (0: poll once).
  /// Precondition: `out` is not empty.
  /// → ok, timeout, stopped (woken), ended (a simulation is at its end), disconnected, failed
  [[nodiscard]] virtual LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept = 0;
  /// All of `bytes`, or not ok: some may have gone out. → ok, timeout, disconnected, failed
  [[nodiscard]] virtual DeviceStatus write(std::span<const std::uint8_t> bytes,
                                           Duration limit) noexcept = 0;
  /// Discards what waits to be read, at the old baud and the new. → ok, unsupported, disconnected
  [[nodiscard]] virtual DeviceStatus set_baud(std::uint32_t baud) noexcept = 0;
  [[nodiscard]] virtual std::uint32_t baud() const noexcept = 0;
  virtual void discard_input() noexcept = 0;
  /// The read that waits, or else the next one, returns `stopped`, once.
  virtual void wake() noexcept = 0;
  [[nodiscard]] virtual HostStamp now() const noexcept = 0;
};

/// A place where a line can be opened, as often as needed: the device may have been unplugged in
/// between.
///
/// Not thread-safe. Allocates.
class SerialLinkFactory {
 public:
  virtual ~SerialLinkFactory() = default;
  /// Null: *status says why. → ok, not_found, no_permission, busy, unsupported, failed
  [[nodiscard]] virtual std::unique_ptr<SerialLink> open(const LineSettings& settings,
                                                         DeviceStatus* status) = 0;
  /// For messages: `/dev/ttyUSB0`, …
  [[nodiscard]] virtual std::string name() const = 0;
  /// Maximum time that a chip between device and host holds bytes back (latency timer of a USB
  /// converter); 0: it does not, or is not known.
  [[nodiscard]] virtual Duration latency_timer() const { return {}; }
  /// For a simulation in virtual time: lets so much of it pass, with no line open. False: time is
  /// real, the caller waits by itself.
  [[nodiscard]] virtual bool pass(Duration /*time*/) { return false; }
};

}  // namespace vergence
