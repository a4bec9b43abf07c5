#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/types/time.hpp"

/// Times as text, in whatever unit and form the program that wrote them chose.
namespace vergence::app {

/// The value is the power of ten that makes nanoseconds of it.
enum class TimeUnit : std::uint8_t {
  nanoseconds = 0,
  microseconds = 3,
  milliseconds = 6,
  seconds = 9
};

[[nodiscard]] const char* to_string(TimeUnit unit) noexcept;
/// `s`, `ms`, `us`, `ns`. Nothing: another word.
[[nodiscard]] std::optional<TimeUnit> parse_time_unit(std::string_view word) noexcept;

/// `2011-09-26 13:02:25.964389445`, with a blank or a T between date and time, with or without a
/// fraction, a Z or an offset (`+02:00`) at its end; without one it is UTC. Nothing: anything else.
[[nodiscard]] std::optional<Stamp> parse_iso_time(std::string_view text) noexcept;

/// Time format of one file.
struct TimeForm {
  TimeUnit unit = TimeUnit::seconds;
  bool absolute = false;  // since 1970, by the magnitude
  bool iso = false;
  // `1403636584.76355584` means 1403636584 s and 76355584 ns: printed without its leading zeros.
  bool nanoseconds_after_point = false;
};

/// Infers the form from some of a file's times, in their order: seconds since 1970 have ten digits
/// today, milliseconds 13, microseconds 16, nanoseconds 19. What is no time since 1970 is in the
/// unit `relative`. `given`: the unit that the user names; it counts whatever the magnitude.
[[nodiscard]] TimeForm find_time_form(std::span<const std::string_view> times,
                                      std::optional<TimeUnit> given,
                                      TimeUnit relative = TimeUnit::seconds);

/// Nothing: the text is no time of this form, or beyond what 64 bits hold.
[[nodiscard]] std::optional<Stamp> read_time(std::string_view text, const TimeForm& form) noexcept;

/// "times are milliseconds by their magnitude"; empty: they are what everybody expects.
[[nodiscard]] std::string describe(const TimeForm& form);

}  // namespace vergence::app
