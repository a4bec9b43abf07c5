#pragma once
#include <cstdint>
#include <optional>

#include "core/types/time.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::xsens {

/// Settings of an XSens INS. Defaults change nothing.
struct Options {
  /// Baud rate; 0: the device's own.
  std::uint32_t baud = 0;
  /// Rate of SyncOut; 0: the device's own; negative: off.
  double sync_out_hz = 0;
  /// Pulse width of SyncOut.
  double sync_out_width_ms = 1;
  Duration processing = Duration::milliseconds(
      2);  // from a sample to its first byte on the wire: acquisition and filter
};

/// Identity of a device.
struct Identity {
  xbus::Generation generation = xbus::Generation::mark4;
  std::uint32_t device_id = 0;
  char product[21] = "";  // of at most 20 characters
  std::uint8_t firmware[3] = {0, 0, 0};
};

/// Settings on which decoding depends.
struct StreamSettings {
  xbus::Generation generation = xbus::Generation::mark4;
  xbus::MtdataLayout layout{};            // MTi-G
  xbus::OutputConfiguration outputs{};    // MTi-G-700/710
  std::int64_t period_numerator = 1;      // the period is so many …
  std::int64_t period_denominator = 100;  // … parts of a second
  double sync_out_hz = 0;                 // as it is; 0: not set by us

  [[nodiscard]] double rate_hz() const noexcept {
    return static_cast<double>(period_denominator) / static_cast<double>(period_numerator);
  }
  /// Nanoseconds of so many samples, exact to one over any count that a drive reaches.
  [[nodiscard]] std::int64_t time_ns(std::int64_t samples) const noexcept {
    const std::int64_t ticks = samples * period_numerator, whole = ticks / period_denominator,
                       part = ticks % period_denominator;
    return whole * 1'000'000'000 + part * 1'000'000'000 / period_denominator;
  }
};

}  // namespace vergence::xsens
