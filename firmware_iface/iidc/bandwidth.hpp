#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

/// Bandwidth of a stream on an IEEE 1394 bus.
namespace vergence::iidc {

enum class BusSpeed : std::uint8_t { s100, s200, s400, s800 };
[[nodiscard]] std::string_view to_string(BusSpeed) noexcept;

/// 20 % of the 6144 units of a cycle of 125 µs are reserved for everything that is not isochronous.
inline constexpr unsigned kBandwidthUnits = 4915;

/// Largest isochronous packet at a speed, in bytes.
[[nodiscard]] constexpr std::size_t largest_packet(BusSpeed speed) noexcept {
  return std::size_t{1024} << static_cast<unsigned>(speed);
}
/// Bandwidth units of a stream with one such packet per cycle: its quadlets plus three for header
/// and checksums, scaled so that S1600 takes one unit per quadlet.
[[nodiscard]] constexpr unsigned bandwidth_units(std::size_t packet_bytes,
                                                 BusSpeed speed) noexcept {
  return static_cast<unsigned>((packet_bytes + 3) / 4 + 3) << (4U - static_cast<unsigned>(speed));
}
/// Largest packet, a multiple of four, that fits into these units; at most largest_packet().
[[nodiscard]] std::size_t packet_for_units(unsigned units, BusSpeed speed) noexcept;

}  // namespace vergence::iidc
