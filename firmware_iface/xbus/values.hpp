#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "firmware_iface/xbus/bytes.hpp"

/// Elements of both generations' data messages.
namespace vergence::xbus {

using Three = std::array<double, 3>;

/// The frame that orientation and velocity refer to: the next two bits of an id.
enum class LocalFrame : std::uint8_t { enu = 0, ned = 1, nwu = 2 };

/// Universal time of the sample; second may be 60.
struct Utc {
  std::uint32_t nanosecond = 0;
  std::uint16_t year = 0;
  std::uint8_t month = 0, day = 0, hour = 0, minute = 0, second = 0;
  std::uint8_t flags = 0;  // 1 time of week valid, 2 week valid, 4 leap seconds known: without it
                           // the time is GPS-based
};

inline constexpr std::uint8_t kUtcTimeOfWeekValid = 1;
inline constexpr std::uint8_t kUtcWeekValid = 2;
inline constexpr std::uint8_t kUtcValid = 4;
inline constexpr std::size_t kUtcSize = 12;  // bytes

/// Precondition: kUtcSize bytes.
[[nodiscard]] Utc read_utc(std::span<const std::uint8_t> b) noexcept;
void write_utc(std::span<std::uint8_t> b, const Utc& utc) noexcept;

/// A date and time that exist: 1980 or later, second up to 60, nanoseconds below a second.
[[nodiscard]] bool plausible(const Utc& utc) noexcept;

/// Nanoseconds since 1970, without leap seconds (as Unix counts). Precondition: plausible.
[[nodiscard]] std::int64_t unix_ns(const Utc& utc) noexcept;
[[nodiscard]] Utc utc_of_unix_ns(std::int64_t ns, std::uint8_t flags) noexcept;

}  // namespace vergence::xbus
