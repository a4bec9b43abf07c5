#include "app/datasets/times_file.hpp"

#include "app/datasets/decimal.hpp"
#include "app/datasets/text_file.hpp"
#include "app/datasets/text_table.hpp"

namespace vergence::app {
namespace {

using Fields = std::vector<std::string_view>;

bool is_number(std::string_view field) {
  double ignored = 0;
  return parse_number(field, &ignored) || parse_decimal(field, 0);
}

/// Name of an image in its directory; lists have it with or without the directory.
std::string name_in(const std::filesystem::path& file, std::size_t line, std::string_view field) {
  const std::string_view name = field.substr(field.rfind('/') + 1);
  if (name.empty() || field.find("..") != std::string_view::npos || name == ".")
    refuse(file, line, "`{}` is not the name of an image in its directory", field.substr(0, 40));
  return std::string(name);
}

}  // namespace

TimeColumns find_time_columns(std::span<const Fields> rows) {
  TimeColumns c;
  const Fields& first = rows.front();
  const auto all = [&](const auto& is) {
    return std::ranges::all_of(rows, [&](const Fields& fields) {
      return fields.size() > c.time + 1 && is(fields, &fields - rows.data());
    });
  };
  const auto start = parse_integer(first[0]);
  const auto is_time = [](std::string_view field) {
    return is_number(field) || parse_iso_time(field) || (field.size() == 10 && field[4] == '-');
  };
  c.counted = start && rows.size() > 1 && all([&](const Fields& fields, std::ptrdiff_t i) {
                return parse_integer(fields[0]) == *start + i && is_time(fields[1]);
              });
  if (c.counted) c.time = 1;
  if (!c.counted && is_image_name(first[0]))
    while (c.time + 1 < first.size() && is_image_name(first[c.time])) ++c.time;
  if (c.time + 1 >= first.size()) return c;
  if (!parse_iso_time(first[c.time]) &&
      parse_iso_time(std::string(first[c.time]) + " " + std::string(first[c.time + 1]))) {
    c.time_of_day = c.time + 1;
    return c;
  }
  constexpr std::int64_t kYear1973 = 100'000'000, kYear5138 = 100'000'000'000,
                         kNsPerSecond = 1'000'000'000;
  bool large = false;
  const bool parts = all([&](const Fields& fields, std::ptrdiff_t) {
    const auto s = parse_integer(fields[c.time]), ns = parse_integer(fields[c.time + 1]);
    large = large || (ns && *ns > 1'000'000);
    return s && ns && *s >= kYear1973 && *s < kYear5138 && *ns >= 0 && *ns < kNsPerSecond;
  });
  if (parts && large) c.nanoseconds = c.time + 1;
  return c;
}

std::optional<Stamp> read_time(std::span<const std::string_view> fields, const TimeColumns& columns,
                               const TimeForm& form) {
  if (columns.last() >= fields.size()) return std::nullopt;
  if (columns.time_of_day)
    return parse_iso_time(std::string(fields[columns.time]) + " " +
                          std::string(fields[*columns.time_of_day]));
  const auto stamp = read_time(fields[columns.time], form);
  if (!stamp || !columns.nanoseconds) return stamp;
  constexpr std::int64_t kFarthest = std::int64_t{1} << 62, kSecond = 1'000'000'000;
  const auto ns = parse_integer(fields[*columns.nanoseconds]);
  if (!ns || *ns < 0 || *ns >= kSecond || std::abs(stamp->ns()) > kFarthest) return std::nullopt;
  return Stamp(stamp->ns() + *ns);
}

TimesFile read_times_file(const std::filesystem::path& file, std::optional<TimeUnit> relative) {
  const std::string text = read_text(file);
  std::vector<Fields> rows;
  std::vector<std::size_t> lines;
  TextTable table(text);
  while (table.next()) rows.push_back(table.fields()), lines.push_back(table.line());
  if (rows.empty()) refuse(file, 0, "holds no times; write one line per frame");

  const TimeColumns columns = find_time_columns(rows);
  std::vector<std::string_view> times;
  bool whole = true;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() <= columns.last())
      refuse(file, lines[i], "has fewer columns than the lines before; complete or remove it");
    times.push_back(rows[i][columns.time]);
    whole = whole && times.back().find_first_of(".eE") == std::string_view::npos;
  }
  const TimeForm form =
      find_time_form(times, columns.nanoseconds ? std::optional(TimeUnit::seconds) : std::nullopt,
                     relative.value_or(whole ? TimeUnit::nanoseconds : TimeUnit::seconds));
  TimesFile out;
  if (columns.counted) out.remarks.emplace_back("the first column counts the lines");
  if (columns.nanoseconds)
    out.remarks.emplace_back("times are seconds and nanoseconds in two columns");
  if (const std::string what = describe(form); !what.empty() && form.unit != TimeUnit::nanoseconds)
    out.remarks.push_back(what);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Fields& fields = rows[i];
    const auto stamp = read_time(fields, columns, form);
    if (!stamp)
      refuse(file, lines[i],
             "`{}` is not a time; write nanoseconds, or seconds with a decimal point",
             times[i].substr(0, 40));
    // Names may precede or follow the time; each may have its own time (`time left time right`).
    Fields names(fields.begin() + (columns.counted ? 1 : 0),
                 fields.begin() + static_cast<std::ptrdiff_t>(columns.time));
    for (std::size_t k = columns.last() + 1; k < fields.size(); ++k) names.push_back(fields[k]);
    if (names.size() == 3 && is_number(names[1])) names.erase(names.begin() + 1);
    if (names.size() > 2)
      refuse(file, lines[i],
             "has {} columns; write a time, optionally followed by one or two image names",
             fields.size());
    TimesLine entry{*stamp, {}};
    for (std::size_t k = 0; k < 2 && !names.empty(); ++k)
      entry.name[k] = name_in(file, lines[i], names[std::min(k, names.size() - 1)]);
    if (!out.lines.empty() && out.lines.front().name[0].empty() != entry.name[0].empty())
      refuse(
          file, lines[i],
          "differs from the other lines in naming an image; name images in every line or in none");
    out.lines.push_back(std::move(entry));
  }
  return out;
}

}  // namespace vergence::app
