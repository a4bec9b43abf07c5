#pragma once
#include <cstdint>

namespace vergence::test {

/// Bootstrap registers of GigE Vision, and the camera's memory.
namespace gvcp {
/// Size in bytes, and address of the description in it.
inline constexpr std::uint32_t kMemory = 0x40000, kDescription = 0x20000;
inline constexpr std::uint32_t kHeartbeat = 0x938, kTicksHigh = 0x93C, kTicksLow = 0x940,
                               kLatch = 0x944, kLatchedHigh = 0x948, kControl = 0xA00,
                               kStreamPort = 0xD00, kPacketSize = 0xD04, kPacketDelay = 0xD08,
                               kStreamTarget = 0xD18;
/// Bytes.
inline constexpr std::uint32_t kSmallestPacket = 576, kLargestPacket = 16'000;

[[nodiscard]] inline std::uint32_t from_wire(const std::uint8_t* p) {
  return static_cast<std::uint32_t>(p[0]) << 24U | static_cast<std::uint32_t>(p[1]) << 16U |
         static_cast<std::uint32_t>(p[2]) << 8U | p[3];
}
}  // namespace gvcp

}  // namespace vergence::test
