#include "firmware_iface/xbus/values.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace vergence::xbus {
namespace {

/// The nearest integer within [lo, hi]; 0 for what is not a number.
std::int64_t nearest(double value, double lo, double hi) noexcept {
  if (!(value == value)) return 0;
  return std::llround(std::clamp(value, lo, hi));
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
  const std::chrono::year_month_day date{std::chrono::year(utc.year), std::chrono::month(utc.month), std::chrono::day(utc.day)};
  return utc.year >= 1980 && utc.year < 2200 && date.ok() && utc.hour < 24 && utc.minute < 60 && utc.second <= 60 &&
         utc.nanosecond < 1'000'000'000U;
}

std::int64_t unix_ns(const Utc& utc) noexcept {
  const std::chrono::sys_days day =
      std::chrono::year_month_day{std::chrono::year(utc.year), std::chrono::month(utc.month), std::chrono::day(utc.day)};
  const std::int64_t seconds =
      static_cast<std::int64_t>(day.time_since_epoch().count()) * 86400 + utc.hour * 3600 + utc.minute * 60 + utc.second;
  return seconds * 1'000'000'000 + utc.nanosecond;
}

Utc utc_of_unix_ns(std::int64_t ns, std::uint8_t flags) noexcept {
  const std::chrono::sys_time<std::chrono::nanoseconds> t{std::chrono::nanoseconds(ns)};
  const auto day = std::chrono::floor<std::chrono::days>(t);
  const std::chrono::year_month_day date{day};
  const std::int64_t of_day = (t - day).count(), second = of_day / 1'000'000'000;
  return {static_cast<std::uint32_t>(of_day % 1'000'000'000),
          static_cast<std::uint16_t>(static_cast<int>(date.year())),
          static_cast<std::uint8_t>(static_cast<unsigned>(date.month())),
          static_cast<std::uint8_t>(static_cast<unsigned>(date.day())),
          static_cast<std::uint8_t>(second / 3600),
          static_cast<std::uint8_t>(second / 60 % 60),
          static_cast<std::uint8_t>(second % 60),
          flags};
}

}  // namespace vergence::xbus
