#include "app/datasets/decimal.hpp"

#include <algorithm>
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

template <class Integer>
bool parse_whole(std::string_view text, Integer* value) noexcept {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return error == std::errc{} && end == text.data() + text.size() && !text.empty();
}

}  // namespace

std::optional<std::int64_t> parse_decimal(std::string_view text, int decimals) noexcept {
  if (text.empty() || text.size() >= kMaxText) return std::nullopt;
  const bool negative = text.front() == '-';
  if (negative || text.front() == '+') text.remove_prefix(1);
  const std::size_t e = std::min(text.find_first_of("eE"), text.size());
  int exponent = 0;
  if (e < text.size()) {
    std::string_view power = text.substr(e + 1);
    if (power.starts_with('+') && !power.starts_with("+-")) power.remove_prefix(1);
    if (!parse_whole(power, &exponent) || exponent > kMaxExponent || exponent < -kMaxExponent)
      return std::nullopt;
  }
  std::string digits(text.substr(0, e));
  const std::size_t point = std::min(digits.find('.'), digits.size());
  digits.erase(point, 1);
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  // Number of digits before the point of the result.
  const int whole = static_cast<int>(point) + exponent + decimals;
  const auto kept = static_cast<std::size_t>(std::max(whole, 0));
  const bool up = whole >= 0 && kept < digits.size() && digits[kept] >= '5';
  digits.resize(kept, '0');
  std::int64_t value = 0;
  if (kept > 0 && !parse_whole(std::string_view(digits), &value)) return std::nullopt;
  if (up && value < std::numeric_limits<std::int64_t>::max()) ++value;
  return negative ? -value : value;
}

std::optional<std::int64_t> parse_seconds_ns(std::string_view text) noexcept {
  return parse_decimal(text, kDecimals);
}

std::optional<std::int64_t> parse_integer(std::string_view text) noexcept {
  std::int64_t value = 0;
  return parse_whole(text, &value) ? std::optional(value) : std::nullopt;
}

std::string format_seconds(std::int64_t ns) {
  std::string text;
  append_seconds(&text, ns);
  return text;
}

void append_seconds(std::string* line, std::int64_t ns) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  // The magnitude is unsigned, because that of the minimum does not fit a signed integer.
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
