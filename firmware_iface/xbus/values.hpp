#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "firmware_iface/xbus/bytes.hpp"

/// Elements of the data messages of both generations.
namespace vergence::xbus {

using Three = std::array<double, 3>;

/// Frame of orientation and velocity; the two bits above the number format in an id.
enum class LocalFrame : std::uint8_t { enu = 0, ned = 1, nwu = 2 };

/// UTC of the sample; second may be 60.
struct Utc {
  std::uint32_t nanosecond = 0;
  std::uint16_t year = 0;
  std::uint8_t month = 0, day = 0, hour = 0, minute = 0, second = 0;
  /// Bits: 1 time of week valid, 2 week valid, 4 leap seconds known, without which the time is
  /// GPS-based.
  std::uint8_t flags = 0;
};

inline constexpr std::uint8_t kUtcTimeOfWeekValid = 1;
inline constexpr std::uint8_t kUtcWeekValid = 2;
inline constexpr std::uint8_t kUtcValid = 4;
/// In bytes.
inline constexpr std::size_t kUtcSize = 12;

/// Precondition: kUtcSize bytes.
[[nodiscard]] Utc read_utc(std::span<const std::uint8_t> b) noexcept;
void write_utc(std::span<std::uint8_t> b, const Utc& utc) noexcept;

/// True for an existing date and time: 1980 or later, second up to 60, nanoseconds below a second.
[[nodiscard]] bool plausible(const Utc& utc) noexcept;

/// Nanoseconds since 1970 without leap seconds (as in Unix time). Precondition: plausible.
[[nodiscard]] std::int64_t unix_ns(const Utc& utc) noexcept;
[[nodiscard]] Utc utc_of_unix_ns(std::int64_t ns, std::uint8_t flags) noexcept;

}  // namespace vergence::xbus
