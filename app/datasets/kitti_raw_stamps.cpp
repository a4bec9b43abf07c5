#include <algorithm>
#include <chrono>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/kitti_raw.hpp"
#include "app/datasets/recorded_ins.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

constexpr std::size_t kLargest = std::size_t{128} << 20U;  // bytes: more lines than may be

/// Whole decimal number of just so many digits, at most `most`. −1: it is none.
int digits(std::string_view text, int most) noexcept {
  int value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return -1;
    value = 10 * value + (c - '0');
  }
  return value <= most ? value : -1;
}

std::size_t decimals(std::string_view line) noexcept {
  const std::size_t point = line.find('.');
  return point == std::string_view::npos ? 0 : line.size() - point - 1;
}

}  // namespace

std::optional<Stamp> parse_kitti_stamp(std::string_view text) noexcept {
  constexpr std::string_view kForm = "0000-00-00 00:00:00";
  if (text.size() < kForm.size() || text.size() > 40) return std::nullopt;
  for (std::size_t i = 0; i < kForm.size(); ++i)
    if (kForm[i] != '0' && text[i] != kForm[i]) return std::nullopt;
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
  std::int64_t ns = 0;
  if (const std::string_view rest = text.substr(kForm.size()); !rest.empty()) {
    if (rest.size() < 2 || rest[0] != '.' || digits(rest.substr(1, 9), 999'999'999) < 0)
      return std::nullopt;
    const auto fraction = parse_seconds_ns(rest);
    if (!fraction) return std::nullopt;
    ns = *fraction;
  }
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  return Stamp((((days * 24 + hour) * 60 + minute) * 60 + second) * 1'000'000'000 + ns);
}

KittiStamps read_kitti_stamps(const std::filesystem::path& file) {
  const std::string text = read_text(file, kLargest);
  KittiStamps stamps;
  std::size_t good = 0, last_decimals = 0;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    const std::string_view line = trimmed(rest.substr(0, end));
    const bool cut = end == std::string_view::npos;
    rest.remove_prefix(cut ? rest.size() : end + 1);
    if (stamps.lines.size() == kMostReadings)
      refuse(file, stamps.lines.size(),
             "and there are more lines: more than any drive has, so this is not the file that is "
             "meant");
    std::optional<Stamp> stamp = parse_kitti_stamp(line);
    if (stamp && cut && good > 0 && decimals(line) < last_decimals) stamp.reset();
    stamps.lines.push_back(stamp);
    if (stamp) {
      ++good;
      last_decimals = decimals(line);
    } else if (stamps.broken++ == 0) {
      stamps.first_broken = stamps.lines.size();
    }
  }
  if (good == 0)
    refuse(file, stamps.first_broken,
           "has no stamp like 2011-09-26 14:05:35.500923136; one a line and file is expected");
  return stamps;
}

/// Patience sorting: for each length the part of that length that ends earliest.
}  // namespace vergence::app::detail
