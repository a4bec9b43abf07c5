#include "app/datasets/times_file.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "app/datasets/decimal.hpp"
#include "app/datasets/text_table.hpp"

namespace vergence::app {
namespace {

bool is_number(std::string_view field) {
  double ignored = 0;
  return parse_number(field, &ignored) || parse_decimal(field, 0);
}

/// Where in a row what is.
struct Row {
  std::size_t time = 0;
  bool parts = false;  // seconds and nanoseconds, in two columns
  bool date = false;   // a date and a time of day, in two columns
  [[nodiscard]] std::size_t first_name() const { return time + (parts || date ? 2 : 1); }
};

struct Line {
  std::vector<std::string_view> fields;
  std::size_t number = 0;
};

/// Infers the columns from all rows, because an index and nanoseconds cannot be recognised in one.
Row row_of(const std::vector<Line>& lines) {
  const std::vector<std::string_view>& first = lines.front().fields;
  Row row;
  row.date = first.size() > 1 && !parse_iso_time(first[0]) &&
             parse_iso_time(std::string(first[0]) + " " + std::string(first[1]));
  if (row.date || first.size() < 2) return row;
  const auto all = [&](const auto& is) {
    return std::all_of(lines.begin(), lines.end(), [&](const Line& line) {
      return line.fields.size() > 1 && is(line.fields, &line - lines.data());
    });
  };
  const auto start = parse_integer(first[0]);
  const bool index = start && all([&](const auto& fields, std::ptrdiff_t i) {
                       return parse_integer(fields[0]) == *start + i &&
                              (is_number(fields[1]) || parse_iso_time(fields[1]));
                     });
  if (index && lines.size() > 1) row.time = 1;
  constexpr std::int64_t kYear1973 = 100'000'000, kYear5138 = 100'000'000'000,
                         kNsPerSecond = 1'000'000'000;
  bool large = false;
  row.parts = all([&](const auto& fields, std::ptrdiff_t) {
    if (fields.size() < row.time + 2) return false;
    const auto s = parse_integer(fields[row.time]), ns = parse_integer(fields[row.time + 1]);
    large = large || (ns && *ns > 1'000'000);
    return s && ns && *s >= kYear1973 && *s < kYear5138 && *ns >= 0 && *ns < kNsPerSecond;
  });
  row.parts = row.parts && large;
  return row;
}

std::array<std::string, 2> names_of(const std::filesystem::path& file, const Line& line,
                                    std::size_t first) {
  std::array<std::string, 2> names;
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string_view name = line.fields[std::min(first + k, line.fields.size() - 1)];
    if (name.empty() || name == "." || name == ".." || name.find('/') != std::string_view::npos)
      refuse(file, line.number,
             fmt::format("`{}` is no name of an image in its folder", name.substr(0, 40)));
    names[k] = name;
  }
  return names;
}

}  // namespace

TimesFile read_times_file(const std::filesystem::path& file, std::optional<TimeUnit> relative) {
  const std::string text = read_text(file);
  std::vector<Line> lines;
  TextTable table(text);
  while (table.next()) lines.push_back({table.fields(), table.line()});
  if (lines.empty()) refuse(file, 0, "holds no times; one line a frame is expected");

  const Row row = row_of(lines);
  std::vector<std::string_view> times;
  bool whole = true;
  for (const Line& line : lines) {
    if (line.fields.size() <= row.time)
      refuse(file, line.number, "has fewer columns than the lines before");
    times.push_back(line.fields[row.time]);
    whole = whole && times.back().find_first_of(".eE") == std::string_view::npos;
  }
  const TimeForm form =
      find_time_form(times, row.parts ? std::optional(TimeUnit::seconds) : std::nullopt,
                     relative.value_or(whole ? TimeUnit::nanoseconds : TimeUnit::seconds));
  TimesFile out;
  if (row.time > 0) out.remarks.emplace_back("the first column counts the lines");
  if (row.parts) out.remarks.emplace_back("times are seconds and nanoseconds in two columns");
  if (const std::string what = describe(form); !what.empty() && form.unit != TimeUnit::nanoseconds)
    out.remarks.push_back(what);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Line& line = lines[i];
    const std::string date = row.date && line.fields.size() > 1
                                 ? std::string(line.fields[0]) + " " + std::string(line.fields[1])
                                 : std::string();
    auto stamp = row.date ? parse_iso_time(date) : read_time(times[i], form);
    constexpr std::int64_t kFarthest = std::int64_t{1} << 62;
    if (stamp && row.parts && stamp->ns() > kFarthest) stamp.reset();
    if (stamp && row.parts)
      stamp = Stamp(stamp->ns() + parse_integer(line.fields[row.time + 1]).value_or(0));
    if (!stamp)
      refuse(file, line.number, fmt::format("`{}` is not a time", times[i].substr(0, 40)));
    TimesLine entry{*stamp, {}};
    const std::size_t columns = line.fields.size() - std::min(line.fields.size(), row.first_name());
    if (columns > 2)
      refuse(file, line.number,
             fmt::format("has {} columns; a time, and one name of an image or two, are expected",
                         line.fields.size()));
    if (columns > 0) entry.name = names_of(file, line, row.first_name());
    if (!out.lines.empty() && out.lines.front().name[0].empty() != entry.name[0].empty())
      refuse(file, line.number,
             "names an image where other lines do not, or the other way round; every line is of "
             "the same kind");
    out.lines.push_back(std::move(entry));
  }
  return out;
}

}  // namespace vergence::app
