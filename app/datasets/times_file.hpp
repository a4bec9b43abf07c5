#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "app/datasets/stamp_text.hpp"

/// Lists of times, with or without the images that they are of.
namespace vergence::app {

struct TimesLine {
  Stamp stamp{};
  std::array<std::string, 2> name{};  // of the image, or of the left and the right one; empty: the
                                      // file names none. Names in the image's folder, no paths.
};

struct TimesFile {
  std::vector<TimesLine> lines{};      // at least one, in the file's order
  std::vector<std::string> remarks{};  // what was assumed: a phrase each
};

/// A line is `[index] time [name [right name]]`, between them blanks, tabs, commas or semicolons;
/// headings may stand before. A time is a number in the unit that its magnitude tells, two whole
/// numbers (seconds and nanoseconds), or a date with a time of day. `relative`: the unit of times
/// that do not count from 1970; nothing: whole numbers are nanoseconds, others seconds.
/// InputError with file:line: no times, a field that is none, a name that is a path, some lines
/// with names and some without.
[[nodiscard]] TimesFile read_times_file(const std::filesystem::path& file,
                                        std::optional<TimeUnit> relative = std::nullopt);

}  // namespace vergence::app
