#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_iface/xbus/configuration.hpp"
#include "firmware_iface/xbus/mtdata.hpp"

/// Load of an output on a serial link. A byte is ten bits on the line (start, eight, stop).
namespace vergence::xbus {

inline constexpr double kMaxLineLoad = 0.9;  // above it a moment's delay is never caught up

/// Bytes of a message in its frame.
[[nodiscard]] constexpr std::size_t frame_size(std::size_t payload) noexcept {
  return payload + (payload > 254 ? 7 : 5);
}

/// Nanoseconds that so many bytes take.
[[nodiscard]] constexpr std::int64_t wire_time_ns(std::size_t bytes, std::uint32_t baud) noexcept {
  return static_cast<std::int64_t>(bytes) * 10'000'000'000 / baud;
}

struct LineBudget {
  double bytes_per_second = 0;
  double load = 0;           // of the line, 1 is all of it
  double greatest_rate = 0;  // Hz, of the samples, at kMaxLineLoad
  std::uint32_t baud_needed =
      0;  // the lowest of the device's that carries it within kMaxLineLoad; 0: none does
  [[nodiscard]] bool fits() const noexcept { return load <= kMaxLineLoad; }
};

/// Load of an MTi-G that sends this layout at this rate. Precondition: the layout is known, rate
/// and baud positive.
[[nodiscard]] LineBudget line_budget(const MtdataLayout& layout, double rate_hz,
                                     std::uint32_t baud) noexcept;
/// Load of an MTi-G-700/710: samples at the highest rate of the list, the receiver's packets in
/// messages of their own.
[[nodiscard]] LineBudget line_budget(const OutputConfiguration& outputs,
                                     std::uint32_t baud) noexcept;

}  // namespace vergence::xbus
