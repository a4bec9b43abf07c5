#include "firmware_iface/xbus/values.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace vergence::xbus {
namespace {

/// The nearest integer within [lo, hi]; 0 for what is not a number.
std::int64_t nearest(double value, double lo, double hi) noexcept {
  if (!(value == value)) return 0;
  return std::llround(std::clamp(value, lo, hi));
}

constexpr std::int64_t kDayNs = 86'400'000'000'000;

constexpr bool leap(int year) noexcept {
  return (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
}

constexpr int days_of(int year, int month) noexcept {
  constexpr std::array<int, 12> kDays{31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  return kDays[static_cast<std::size_t>(month - 1)] + (month == 2 && leap(year) ? 1 : 0);
}

/// Days from 1970-01-01 to the first of January, Gregorian.
constexpr std::int64_t days_before(int year) noexcept {
  const int y = year - 1;
  return 365LL * (year - 1970) + (y / 4 - y / 100 + y / 400) - (1969 / 4 - 1969 / 100 + 1969 / 400);
}

}  // namespace

void write_number(std::span<std::uint8_t> b, NumberFormat format, double value) noexcept {
  switch (format) {
    case NumberFormat::float32:
      write_u32(b, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
      return;
    case NumberFormat::fp12_20: {
      const std::int64_t n = nearest(value * 1048576.0, -2147483648.0, 2147483647.0);
      write_u32(b, static_cast<std::uint32_t>(n));
      return;
    }
    case NumberFormat::fp16_32: {
      const std::int64_t n = nearest(value * 4294967296.0, -0x1p47, 0x1p47 - 1);
      write_u32(b, static_cast<std::uint32_t>(n));
      write_u16(b.subspan(4), static_cast<std::uint16_t>(n >> 32));
      return;
    }
    case NumberFormat::float64:
      write_u64(b, std::bit_cast<std::uint64_t>(value));
      return;
  }
}

Utc read_utc(std::span<const std::uint8_t> b) noexcept {
  return {read_u32(b), read_u16(b.subspan(4)), b[6], b[7], b[8], b[9], b[10], b[11]};
}

void write_utc(std::span<std::uint8_t> b, const Utc& utc) noexcept {
  write_u32(b, utc.nanosecond);
  write_u16(b.subspan(4), utc.year);
  b[6] = utc.month;
  b[7] = utc.day;
  b[8] = utc.hour;
  b[9] = utc.minute;
  b[10] = utc.second;
  b[11] = utc.flags;
}

bool plausible(const Utc& utc) noexcept {
  return utc.year >= 1980 && utc.year < 2200 && utc.month >= 1 && utc.month <= 12 && utc.day >= 1 &&
         utc.day <= days_of(utc.year, utc.month) && utc.hour < 24 && utc.minute < 60 &&
         utc.second <= 60 && utc.nanosecond < 1'000'000'000U;
}

std::int64_t unix_ns(const Utc& utc) noexcept {
  std::int64_t days = days_before(utc.year) + utc.day - 1;
  for (int month = 1; month < utc.month; ++month) days += days_of(utc.year, month);
  const std::int64_t seconds = utc.hour * 3600 + utc.minute * 60 + utc.second;
  return days * kDayNs + seconds * 1'000'000'000 + utc.nanosecond;
}

Utc utc_of_unix_ns(std::int64_t ns, std::uint8_t flags) noexcept {
  std::int64_t day = ns / kDayNs, of_day = ns % kDayNs;
  if (of_day < 0) --day, of_day += kDayNs;
  // Exact within a year; 146 097 days are four centuries.
  int year = static_cast<int>(1970 + day * 400 / 146'097);
  while (days_before(year + 1) <= day) ++year;
  while (days_before(year) > day) --year;
  std::int64_t left = day - days_before(year);
  int month = 1;
  while (left >= days_of(year, month)) left -= days_of(year, month++);
  const std::int64_t second = of_day / 1'000'000'000;
  return {static_cast<std::uint32_t>(of_day % 1'000'000'000),
          static_cast<std::uint16_t>(year),
          static_cast<std::uint8_t>(month),
          static_cast<std::uint8_t>(left + 1),
          static_cast<std::uint8_t>(second / 3600),
          static_cast<std::uint8_t>(second / 60 % 60),
          static_cast<std::uint8_t>(second % 60),
          flags};
}

}  // namespace vergence::xbus
