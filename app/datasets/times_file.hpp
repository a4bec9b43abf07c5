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

/// Lists of times, with or without the images that they are of.
namespace vergence::app {

struct TimesLine {
  Stamp stamp{};
  std::array<std::string, 2> name{};  // of the image, or of the left and the right one; empty: the
                                      // file names none. Without the folder before it
};

struct TimesFile {
  std::vector<TimesLine> lines{};      // at least one, in the file's order
  std::vector<std::string> remarks{};  // what was assumed: a phrase each
};

/// Where in the rows of a table the time stands.
struct TimeColumns {
  std::size_t time = 0;
  std::optional<std::size_t> nanoseconds{};  // beside whole seconds
  std::optional<std::size_t> time_of_day{};  // beside a date
  bool counted = false;                      // a column before it counts the rows
  [[nodiscard]] std::size_t last() const {
    return std::max({time, nanoseconds.value_or(0), time_of_day.value_or(0)});
  }
};

/// Infers the columns from all rows, because an index and nanoseconds cannot be recognised in one.
/// Precondition: there is a row with a field.
[[nodiscard]] TimeColumns find_time_columns(std::span<const std::vector<std::string_view>> rows);

/// The time of a row; nothing: it has none of this form.
[[nodiscard]] std::optional<Stamp> read_time(std::span<const std::string_view> fields,
                                             const TimeColumns& columns, const TimeForm& form);

/// A line is `[index] time [name [right name]]`, between them blanks, tabs, commas or semicolons,
/// or its names stand first; headings may stand before. A time is a number in the unit that its
/// magnitude tells, two whole numbers (seconds and nanoseconds), or a date with a time of day.
/// `relative`: the unit of times that do not count from 1970; nothing: whole numbers are
/// nanoseconds, others seconds. InputError with file:line: no times, a field that is none, a name
/// that leads out of its folder, some lines with names and some without.
[[nodiscard]] TimesFile read_times_file(const std::filesystem::path& file,
                                        std::optional<TimeUnit> relative = std::nullopt);

}  // namespace vergence::app
