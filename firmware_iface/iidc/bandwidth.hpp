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

/// The largest isochronous packet at a speed, bytes.
[[nodiscard]] constexpr std::size_t largest_packet(BusSpeed speed) noexcept {
  return std::size_t{1024} << static_cast<unsigned>(speed);
}
/// Units of a stream with one such packet a cycle: quadlets and three more for header and
/// checksums; S1600 would take one a quadlet.
[[nodiscard]] constexpr unsigned bandwidth_units(std::size_t packet_bytes,
                                                 BusSpeed speed) noexcept {
  return static_cast<unsigned>((packet_bytes + 3) / 4 + 3) << (4U - static_cast<unsigned>(speed));
}
/// The largest packet, a multiple of four, that these units carry; never above largest_packet().
[[nodiscard]] std::size_t packet_for_units(unsigned units, BusSpeed speed) noexcept;

}  // namespace vergence::iidc
