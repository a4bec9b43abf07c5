#include "app/datasets/stamp_text.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <vector>

#include "app/datasets/decimal.hpp"
#include "app/datasets/text_file.hpp"
#include "core/math/robust.hpp"

namespace vergence::app {
namespace {

// In ns.
constexpr std::int64_t kSecond = 1'000'000'000;

/// Decimal integer of at most `most` that consists of digits only; −1 otherwise.
int digits(std::string_view text, int most) noexcept {
  int value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return -1;
    value = 10 * value + (c - '0');
  }
  return value <= most ? value : -1;
}

/// Removes `Z`, `+02:00`, `+0200` or `+02` from the end of a time of day. Returns the offset in s
/// east of UTC.
std::optional<int> parse_offset(std::string_view* text) noexcept {
  if (text->ends_with('Z') || text->ends_with('z')) {
    text->remove_suffix(1);
    return 0;
  }
  const std::size_t sign = text->find_last_of("+-");
  if (sign == std::string_view::npos) return 0;
  const std::string_view offset = text->substr(sign + 1);
  const int hours = digits(offset.substr(0, 2), 14);
  const std::string_view rest = offset.substr(std::min<std::size_t>(2, offset.size()));
  const std::string_view minutes = rest.starts_with(':') ? rest.substr(1) : rest;
  const int past = minutes.empty() ? 0 : digits(minutes, 59);
  if (offset.size() < 2 || hours < 0 || past < 0 || (!minutes.empty() && minutes.size() != 2))
    return std::nullopt;
  const int seconds = 3600 * hours + 60 * past;
  const bool west = (*text)[sign] == '-';
  text->remove_suffix(text->size() - sign);
  return west ? -seconds : seconds;
}

/// Parses seconds before the point and whole nanoseconds after it.
std::optional<Stamp> read_parts(std::string_view text) noexcept {
  // Maximum that 64 bits of nanoseconds hold.
  constexpr std::int64_t kMaxSeconds = 9'000'000'000;
  const std::size_t point = text.find('.');
  const auto s = parse_integer(text.substr(0, point));
  const auto ns = point == std::string_view::npos ? std::optional<std::int64_t>(0)
                                                  : parse_integer(text.substr(point + 1));
  if (!s || !ns || *s < 0 || *s > kMaxSeconds || *ns < 0 || *ns >= kSecond) return std::nullopt;
  return Stamp(*s * kSecond + *ns);
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
  std::size_t least = 9, most = 0;
  for (const std::string_view text : times) {
    const std::size_t point = text.find('.');
    if (point == std::string_view::npos) return false;
    least = std::min(least, text.size() - point - 1);
    most = std::max(most, text.size() - point - 1);
  }
  return least < most && most == 9;
}

}  // namespace

const char* to_string(TimeUnit unit) noexcept {
  constexpr std::array kNames{"nanoseconds", "microseconds", "milliseconds", "seconds"};
  return kNames[static_cast<std::size_t>(unit) / 3];
}

std::optional<TimeUnit> parse_time_unit(std::string_view word) noexcept {
  if (word == "s") return TimeUnit::seconds;
  if (word == "ms") return TimeUnit::milliseconds;
  if (word == "us") return TimeUnit::microseconds;
  if (word == "ns") return TimeUnit::nanoseconds;
  return std::nullopt;
}

std::optional<Stamp> parse_iso_time(std::string_view text) noexcept {
  constexpr std::string_view kForm = "0000-00-00 00:00:00";
  // Position between date and time.
  constexpr std::size_t kBetween = 10;
  if (text.size() < kForm.size() || text.size() > 45) return std::nullopt;
  for (std::size_t i = 0; i < kForm.size(); ++i)
    // File names cannot contain colons.
    if (kForm[i] != '0' && text[i] != kForm[i] && !(kForm[i] == ':' && text[i] == '-') &&
        !(i == kBetween && (text[i] == 'T' || text[i] == 't' || text[i] == '_')))
      return std::nullopt;
  const int year = digits(text.substr(0, 4), 2200), month = digits(text.substr(5, 2), 12),
            day = digits(text.substr(8, 2), 31);
  const int hour = digits(text.substr(11, 2), 23), minute = digits(text.substr(14, 2), 59),
            second = digits(text.substr(17, 2), 60);
  if (year < 1970 || month < 1 || day < 1 || hour < 0 || minute < 0 || second < 0)
    return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) return std::nullopt;
  std::string_view rest = text.substr(kForm.size());
  const auto offset = parse_offset(&rest);
  if (!offset) return std::nullopt;
  std::int64_t ns = 0;
  if (!rest.empty()) {
    if (rest.size() < 2 || rest[0] != '.' || digits(rest.substr(1, 9), 999'999'999) < 0)
      return std::nullopt;
    const auto fraction = parse_seconds_ns(rest);
    if (!fraction) return std::nullopt;
    ns = *fraction;
  }
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  return Stamp((((days * 24 + hour) * 60 + minute) * 60 + second - *offset) * kSecond + ns);
}

TimeForm find_time_form(std::span<const std::string_view> times, std::optional<TimeUnit> given,
                        TimeUnit relative) {
  TimeForm form;
  form.unit = given.value_or(relative);
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

std::optional<Stamp> read_time(std::string_view text, const TimeForm& form) noexcept {
  if (form.iso) return parse_iso_time(text);
  if (form.nanoseconds_after_point) return read_parts(text);
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
