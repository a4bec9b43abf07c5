#pragma once
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/datasets/stamp_text.hpp"

/// Lists of times, with or without their images.
namespace vergence::app {

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
