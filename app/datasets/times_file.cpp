#include "app/datasets/times_file.hpp"

#include <ctime>
#include <ranges>

#include "app/datasets/image_file.hpp"
#include "app/datasets/text_file.hpp"
#include "core/math/robust.hpp"

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

// In ns.
constexpr std::int64_t kSecond = 1'000'000'000;

/// Unit of times since 1970, which share their leading digits; empty if they do not. Times since
/// boot may have as many digits in a smaller unit. Then only `relative` gives plausible steps.
std::optional<TimeUnit> unit_by_magnitude(std::span<const std::string_view> times,
                                          TimeUnit relative) {
  // Times are in s.
  constexpr double kSpread = 0.05, kYear1973 = 1e8, kYear2286 = 1e10;
  // Shortest and longest step of a sequence in s.
  constexpr double kShortest = 1e-4, kLongest = 10;
  std::vector<double> values, steps;
  for (const std::string_view text : times) {
    double v = 0;
    if (!parse_number(text, &v)) continue;
    if (!values.empty()) steps.push_back(std::abs(v - values.back()));
    values.push_back(std::abs(v));
  }
  if (values.empty()) return std::nullopt;
  std::ranges::sort(values);
  const std::size_t n = values.size();
  const double middle = values[n / 2];
  if (values[3 * n / 4] - values[n / 4] > kSpread * middle) return std::nullopt;
  for (const TimeUnit unit :
       {TimeUnit::seconds, TimeUnit::milliseconds, TimeUnit::microseconds, TimeUnit::nanoseconds}) {
    const auto of_a_drive = [&](TimeUnit u) {
      const double step = median(std::span(steps)) * std::pow(10.0, static_cast<int>(u) - 9);
      return step >= kShortest && step <= kLongest;
    };
    const double seconds = middle * std::pow(10.0, static_cast<int>(unit) - 9);
    if (seconds < kYear1973 || seconds >= kYear2286) continue;
    if (!steps.empty() && unit != relative && !of_a_drive(unit) && of_a_drive(relative))
      return std::nullopt;
    return unit;
  }
  return std::nullopt;
}

/// True if the numbers of decimals differ and the maximum is that of nanoseconds.
bool may_be_parts(std::span<const std::string_view> times) {
  const auto [least, most] =
      std::ranges::minmax(times | std::views::transform([](std::string_view text) {
                            const std::size_t point = std::min(text.find('.'), text.size());
                            return text.substr(point).size();
                          }));
  return least > 0 && least < most && most == std::string_view(".000000000").size();
}

bool ascend(std::span<const std::string_view> times, const TimeForm& form) {
  std::optional<Stamp> before;
  for (const std::string_view text : times) {
    const auto time = read_time(text, form);
    if (!time || (before && *time < *before)) return false;
    before = time;
  }
  return true;
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
  constexpr std::int64_t kYear1973 = 100'000'000, kYear5138 = 100'000'000'000;
  bool large = false;
  const bool parts = all([&](const Fields& fields, std::ptrdiff_t) {
    const auto s = parse_integer(fields[c.time]), ns = parse_integer(fields[c.time + 1]);
    large = large || (ns && *ns > 1'000'000);
    return s && ns && *s >= kYear1973 && *s < kYear5138 && *ns >= 0 && *ns < kSecond;
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
  return columns.nanoseconds
             ? read_parts(fields[columns.time], fields[*columns.nanoseconds], kSecond)
             : read_time(fields[columns.time], form);
}

TimesFile read_times_file(const std::filesystem::path& file, std::optional<TimeUnit> relative) {
  const std::string text = read_text(file);
  std::vector<Fields> rows;
  std::vector<std::size_t> lines;
  TimesFile out;
  TextTable table(text);
  while (table.next())
    if (table.unfinished() && !rows.empty() && table.fields().size() < rows.back().size())
      out.remarks.emplace_back("the last line of the times is incomplete and is skipped");
    else
      rows.push_back(table.fields()), lines.push_back(table.line());
  if (rows.empty())
    refuse(
        file, 0,
        "holds no times; write nanoseconds, or seconds with a decimal point, one line per frame");

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

const char* to_string(TimeUnit unit) noexcept {
  constexpr std::array kNames{"nanoseconds", "microseconds", "milliseconds", "seconds"};
  return kNames[static_cast<std::size_t>(unit) / 3];
}

std::optional<TimeUnit> parse_time_unit(std::string_view word) noexcept {
  for (const auto& [name, unit] : {std::pair<std::string_view, TimeUnit>{"s", TimeUnit::seconds},
                                   {"ms", TimeUnit::milliseconds},
                                   {"us", TimeUnit::microseconds},
                                   {"ns", TimeUnit::nanoseconds}})
    if (word == name) return unit;
  return std::nullopt;
}

std::optional<Stamp> parse_iso_time(std::string_view text) noexcept {
  constexpr std::string_view kForm = "0000-00-00 00:00:00";
  constexpr std::size_t kBetween = 10;
  if (text.size() < kForm.size() || text.size() > 45 || text[4] != '-') return std::nullopt;
  std::array<char, kForm.size() + 1> form{};
  text.copy(form.data(), kForm.size());
  if (form[kBetween] == 'T' || form[kBetween] == 't' || form[kBetween] == '_') form[kBetween] = ' ';
  // File names cannot contain colons.
  for (const std::size_t i : {kBetween + 3, kBetween + 6})
    if (form[i] == '-') form[i] = ':';
  std::tm parts{};
  const char* end = ::strptime(form.data(), "%Y-%m-%d %H:%M:%S", &parts);
  if (end != &form.back() || parts.tm_year < 70) return std::nullopt;
  const int day = parts.tm_mday;
  const std::int64_t seconds = ::timegm(&parts);
  // February 31 becomes a day in March.
  if (parts.tm_mday != day) return std::nullopt;
  std::string_view rest = text.substr(kForm.size());
  std::int64_t ns = 0;
  if (rest.starts_with('.')) {
    const std::string_view fraction = rest.substr(0, rest.find_first_not_of(".0123456789"));
    const auto parsed = parse_seconds_ns(fraction);
    if (!parsed || fraction.size() < 2) return std::nullopt;
    ns = *parsed;
    rest.remove_prefix(fraction.size());
  }
  if (!rest.empty()) {
    std::array<char, 46> zone{};
    rest.copy(zone.data(), zone.size() - 1);
    end = ::strptime(zone.data(), "%z", &parts);
    if (end == nullptr || *end != 0) return std::nullopt;
  }
  return Stamp((seconds - parts.tm_gmtoff) * kSecond + ns);
}

TimeForm find_time_form(std::span<const std::string_view> times, std::optional<TimeUnit> given,
                        TimeUnit relative) {
  TimeForm form{.unit = given.value_or(relative)};
  if (times.empty()) return form;
  if (parse_iso_time(times.front())) {
    form.iso = form.absolute = true;
    return form;
  }
  const auto unit = unit_by_magnitude(times, relative);
  form.absolute = unit.has_value();
  if (unit && !given) form.unit = *unit;
  if (form.unit == TimeUnit::seconds && may_be_parts(times) && !ascend(times, form)) {
    form.nanoseconds_after_point = true;
    form.nanoseconds_after_point = ascend(times, form);
  }
  return form;
}

std::optional<Stamp> read_parts(std::string_view seconds, std::string_view fraction,
                                std::int64_t per_second) noexcept {
  // Maximum that 64 bits of nanoseconds hold.
  constexpr std::int64_t kMaxSeconds = 9'000'000'000;
  const auto s = parse_integer(seconds), part = parse_integer(fraction);
  if (!s || !part || *s < 0 || *s > kMaxSeconds || *part < 0 || *part >= per_second)
    return std::nullopt;
  return Stamp(*s * kSecond + *part * (kSecond / per_second));
}

std::optional<Stamp> read_time(std::string_view text, const TimeForm& form) noexcept {
  if (form.iso) return parse_iso_time(text);
  if (form.nanoseconds_after_point) {
    const std::size_t point = std::min(text.find('.'), text.size());
    return read_parts(text.substr(0, point), text.substr(std::min(point + 1, text.size())),
                      kSecond);
  }
  const auto ns = parse_decimal(text, static_cast<int>(form.unit));
  return ns ? std::optional(Stamp(*ns)) : std::nullopt;
}

std::string describe(const TimeForm& form) {
  if (form.nanoseconds_after_point)
    return "times are seconds with nanoseconds behind the point, without their leading zeros";
  if (form.iso || !form.absolute || form.unit == TimeUnit::seconds) return "";
  return std::string("times are ") + to_string(form.unit) + " by their magnitude";
}

}  // namespace vergence::app
