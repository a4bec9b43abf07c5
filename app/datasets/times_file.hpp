#pragma once
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/time.hpp"

/// Times as text in the units and formats of other programs, and lists of them.
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
  /// True if `1403636584.76355584` means 1403636584 s and 76355584 ns, printed without leading
  /// zeros.
  bool nanoseconds_after_point = false;
};

/// Infers the format from some of a file's times, in order: seconds since 1970 have ten digits
/// today, milliseconds 13, microseconds 16, nanoseconds 19. Other times are in the unit `relative`.
/// `given` is the user's unit, which takes precedence.
[[nodiscard]] TimeForm find_time_form(std::span<const std::string_view> times,
                                      std::optional<TimeUnit> given,
                                      TimeUnit relative = TimeUnit::seconds);

/// Seconds since 1970 and whole fractions of a second, `per_second` of which are one; empty if the
/// texts are others.
[[nodiscard]] std::optional<Stamp> read_parts(std::string_view seconds, std::string_view fraction,
                                              std::int64_t per_second) noexcept;

/// Empty if the text is not a time of this format, or exceeds 64 bits.
[[nodiscard]] std::optional<Stamp> read_time(std::string_view text, const TimeForm& form) noexcept;

/// Text such as "times are milliseconds by their magnitude"; empty for the usual format.
[[nodiscard]] std::string describe(const TimeForm& form);

struct TimesLine {
  Stamp stamp{};
  /// Name of the image, or of the left and right one, without its directory; empty if the file has
  /// none.
  std::array<std::string, 2> name{};
};

struct TimesFile {
  /// At least one, in the file's order.
  std::vector<TimesLine> lines{};
  /// A phrase for each assumption.
  std::vector<std::string> remarks{};
};

/// Columns of the time in a table.
struct TimeColumns {
  std::size_t time = 0;
  /// Nanoseconds next to whole seconds.
  std::optional<std::size_t> nanoseconds{};
  /// Time of day next to a date.
  std::optional<std::size_t> time_of_day{};
  /// True if a preceding column counts the rows.
  bool counted = false;
  [[nodiscard]] std::size_t last() const {
    return std::max({time, nanoseconds.value_or(0), time_of_day.value_or(0)});
  }
};

/// Infers the columns from all rows, because an index and nanoseconds cannot be recognised in one.
/// Precondition: there is a row with a field.
[[nodiscard]] TimeColumns find_time_columns(std::span<const std::vector<std::string_view>> rows);

/// Time of a row; empty if it has none of this format.
[[nodiscard]] std::optional<Stamp> read_time(std::span<const std::string_view> fields,
                                             const TimeColumns& columns, const TimeForm& form);

/// Reads lines `[index] time [name [right name]]`, separated by blanks, tabs, commas or semicolons,
/// or with names first; headings may precede. A time is a number whose magnitude tells the unit,
/// two whole numbers (seconds and nanoseconds), or a date with a time of day. `relative` is the
/// unit of times that do not count from 1970; if empty, whole numbers are nanoseconds, others
/// seconds. Throws InputError with file:line without times, or for an invalid time, a name outside
/// its directory, or names in some lines only.
[[nodiscard]] TimesFile read_times_file(const std::filesystem::path& file,
                                        std::optional<TimeUnit> relative = std::nullopt);

}  // namespace vergence::app
