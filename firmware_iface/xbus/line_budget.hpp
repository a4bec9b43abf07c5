#pragma once
#include <cstddef>
#include <cstdint>

#include "firmware_iface/xbus/configuration.hpp"
#include "firmware_iface/xbus/mtdata.hpp"

/// Load of an output on a serial link. A byte takes ten bits (start, eight, stop).
namespace vergence::xbus {

/// Above this load a delay is never made up.
inline constexpr double kMaxLineLoad = 0.9;

/// Size of a framed message in bytes.
[[nodiscard]] constexpr std::size_t frame_size(std::size_t payload) noexcept {
  return payload + (payload > 254 ? 7 : 5);
}

/// Transmission time in nanoseconds.
[[nodiscard]] constexpr std::int64_t wire_time_ns(std::size_t bytes, std::uint32_t baud) noexcept {
  return static_cast<std::int64_t>(bytes) * 10'000'000'000 / baud;
}

struct LineBudget {
  double bytes_per_second = 0;
  /// Share of the link's capacity.
  double load = 0;
  /// Highest sample rate at kMaxLineLoad, in Hz.
  double greatest_rate = 0;
  /// Lowest supported baud rate within kMaxLineLoad; 0 if there is none.
  std::uint32_t baud_needed = 0;
  [[nodiscard]] bool fits() const noexcept { return load <= kMaxLineLoad; }
};

/// Load of an MTi-G with this layout and rate. Precondition: the layout is known, rate and baud
/// positive.
[[nodiscard]] LineBudget line_budget(const MtdataLayout& layout, double rate_hz,
                                     std::uint32_t baud) noexcept;
/// Load of an MTi-G-700/710: samples at the list's highest rate, the receiver's packets in separate
/// messages.
[[nodiscard]] LineBudget line_budget(const OutputConfiguration& outputs,
                                     std::uint32_t baud) noexcept;

}  // namespace vergence::xbus
