#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/types/time.hpp"

/// Times as text in the units and formats of other programs.
namespace vergence::app {

/// The value is the power of ten that converts to nanoseconds.
enum class TimeUnit : std::uint8_t {
  nanoseconds = 0,
  microseconds = 3,
  milliseconds = 6,
  seconds = 9
};

[[nodiscard]] const char* to_string(TimeUnit unit) noexcept;
/// Parses `s`, `ms`, `us` or `ns`; empty otherwise.
[[nodiscard]] std::optional<TimeUnit> parse_time_unit(std::string_view word) noexcept;

/// Parses `2011-09-26 13:02:25.964389445`, with a blank or a T between date and time, with or
/// without a fraction, a Z or an offset (`+02:00`); without one it is UTC. Empty otherwise.
[[nodiscard]] std::optional<Stamp> parse_iso_time(std::string_view text) noexcept;

/// Time format of one file.
struct TimeForm {
  TimeUnit unit = TimeUnit::seconds;
  /// Since 1970, inferred by the magnitude.
  bool absolute = false;
  bool iso = false;
  // True if `1403636584.76355584` means 1403636584 s and 76355584 ns, printed without leading
  // zeros.
  bool nanoseconds_after_point = false;
};

/// Infers the format from some of a file's times, in order: seconds since 1970 have ten digits
/// today, milliseconds 13, microseconds 16, nanoseconds 19. Other times are in the unit `relative`.
/// `given` is the user's unit, which takes precedence.
[[nodiscard]] TimeForm find_time_form(std::span<const std::string_view> times,
                                      std::optional<TimeUnit> given,
                                      TimeUnit relative = TimeUnit::seconds);

/// Empty if the text is not a time of this format, or exceeds 64 bits.
[[nodiscard]] std::optional<Stamp> read_time(std::string_view text, const TimeForm& form) noexcept;

/// Text such as "times are milliseconds by their magnitude"; empty for the usual format.
[[nodiscard]] std::string describe(const TimeForm& form);

}  // namespace vergence::app
