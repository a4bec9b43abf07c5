#pragma once
#include <cstdint>

#include "core/types/time.hpp"
#include "firmware_iface/xbus/xbus.hpp"

namespace vergence::xsens {

/// Settings of an XSens INS. Defaults change nothing.
struct Options {
  /// Baud rate; 0 keeps the device's own.
  std::uint32_t baud = 0;
  /// Rate of SyncOut; 0 keeps the device's own, negative turns it off.
  double sync_out_hz = 0;
  /// Pulse width of SyncOut.
  double sync_out_width_ms = 1;
  /// Delay from a sample to its first byte on the wire, for acquisition and filter.
  Duration processing = Duration::milliseconds(2);
};

/// Identity of a device.
struct Identity {
  xbus::Generation generation = xbus::Generation::mark4;
  std::uint32_t device_id = 0;
  /// Product code of at most 20 characters.
  char product[21] = "";
  std::uint8_t firmware[3] = {0, 0, 0};
};

/// Settings on which decoding depends.
struct StreamSettings {
  xbus::Generation generation = xbus::Generation::mark4;
  /// Used by MTi-G.
  xbus::MtdataLayout layout{};
  /// Used by MTi-G-700/710.
  xbus::OutputConfiguration outputs{};
  /// Period in seconds, as a fraction.
  std::int64_t period_numerator = 1;
  std::int64_t period_denominator = 100;
  /// Rate in use; 0 if not set by this driver.
  double sync_out_hz = 0;

  [[nodiscard]] double rate_hz() const noexcept {
    return static_cast<double>(period_denominator) / static_cast<double>(period_numerator);
  }
  /// Nanoseconds of this number of samples, exact to 1 ns.
  [[nodiscard]] std::int64_t time_ns(std::int64_t samples) const noexcept {
    const std::int64_t ticks = samples * period_numerator, whole = ticks / period_denominator,
                       part = ticks % period_denominator;
    return whole * 1'000'000'000 + part * 1'000'000'000 / period_denominator;
  }
};

}  // namespace vergence::xsens
