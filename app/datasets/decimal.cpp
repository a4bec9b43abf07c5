#include "app/datasets/decimal.hpp"

#include <charconv>
#include <iterator>
#include <limits>

#include <fmt/format.h>

namespace vergence::app {
namespace {

// A second has this many decimals in nanoseconds.
constexpr int kDecimals = 9;
// A larger exponent means 0 or a time far outside of 64 bits.
constexpr int kMaxExponent = 100;
// Longer text is not a number.
constexpr std::size_t kMaxText = 64;

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// Appends a decimal digit; false when it does not fit.
bool append(std::uint64_t* value, int digit) noexcept {
  constexpr auto kMax = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const auto d = static_cast<std::uint64_t>(digit);
  if (*value > (kMax - d) / 10) return false;
  *value = *value * 10 + d;
  return true;
}

/// Digits of a number with the place of its decimal point: 0.d1d2d3… × 10^point.
struct Digits {
  char digit[kMaxText];
  int count = 0;
  int point = 0;
};

std::optional<Digits> read_digits(std::string_view text) noexcept {
  Digits d{};
  bool any = false, after_point = false;
  std::size_t i = 0;
  for (; i < text.size() && (is_digit(text[i]) || (text[i] == '.' && !after_point)); ++i) {
    if (text[i] == '.') {
      after_point = true;
      continue;
    }
    any = true;
    d.digit[d.count++] = text[i];
    if (!after_point) ++d.point;
  }
  if (!any) return std::nullopt;
  if (i == text.size()) return d;
  if (text[i] != 'e' && text[i] != 'E') return std::nullopt;
  ++i;
  if (i + 1 < text.size() && text[i] == '+' && is_digit(text[i + 1])) ++i;
  int exponent = 0;
  const auto [end, error] = std::from_chars(text.data() + i, text.data() + text.size(), exponent);
  if (error != std::errc{} || end != text.data() + text.size() || exponent > kMaxExponent ||
      exponent < -kMaxExponent)
    return std::nullopt;
  d.point += exponent;
  return d;
}

}  // namespace

std::optional<std::int64_t> parse_decimal(std::string_view text, int decimals) noexcept {
  if (text.empty() || text.size() >= kMaxText) return std::nullopt;
  const bool negative = text.front() == '-';
  if (negative || text.front() == '+') text.remove_prefix(1);
  const std::optional<Digits> d = read_digits(text);
  if (!d) return std::nullopt;
  std::uint64_t ns = 0;
  // Number of digits before the point of the result.
  const int requested = d->point + decimals;
  for (int i = 0; i < requested; ++i) {
    // Only zeros follow zeros.
    if (i >= d->count && ns == 0) break;
    if (!append(&ns, i < d->count ? d->digit[i] - '0' : 0)) return std::nullopt;
  }
  if (requested >= 0 && requested < d->count && d->digit[requested] >= '5' &&
      ns < static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
    ++ns;
  const auto value = static_cast<std::int64_t>(ns);
  return negative ? -value : value;
}

std::optional<std::int64_t> parse_seconds_ns(std::string_view text) noexcept {
  return parse_decimal(text, kDecimals);
}

std::optional<std::int64_t> parse_integer(std::string_view text) noexcept {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

std::string format_seconds(std::int64_t ns) {
  std::string text;
  append_seconds(&text, ns);
  return text;
}

void append_seconds(std::string* line, std::int64_t ns) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  // The magnitude in unsigned arithmetic: that of the least integer does not fit a signed one.
  const std::uint64_t magnitude =
      ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  fmt::format_to(std::back_inserter(*line), "{}{}.{:09}", ns < 0 ? "-" : "", magnitude / kSecond,
                 magnitude % kSecond);
}

std::string_view trimmed(std::string_view text) noexcept {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

}  // namespace vergence::app
