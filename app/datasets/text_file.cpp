#include "app/datasets/text_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kBlanks = " \t\r\v\f";

/// Converts UTF-16, of which some editors write either byte order. Characters beyond ASCII become
/// question marks, because no number, key or name that is read here contains them.
std::string narrowed(const std::string& wide, bool min_first) {
  std::string text;
  text.reserve(wide.size() / 2);
  for (std::size_t i = 2; i + 1 < wide.size(); i += 2) {
    const char low = wide[i + (min_first ? 0 : 1)], high = wide[i + (min_first ? 1 : 0)];
    text.push_back(high == 0 && static_cast<signed char>(low) >= 0 ? low : '?');
  }
  return text;
}

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

void refuse(const std::filesystem::path& file, std::size_t line, std::string_view what) {
  std::string message = file.string();
  if (line > 0) message += ":" + std::to_string(line);
  message += ": ";
  message += what;
  throw InputError(message);
}

std::string read_text(const std::filesystem::path& file, std::size_t limit) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (std::filesystem::is_directory(status)) refuse(file, 0, "is a directory; name a file");
  // Reading a pipe would block indefinitely.
  if (std::filesystem::is_other(status))
    refuse(file, 0, "is a pipe or a device; name a regular file");
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    const int e = errno;
    refuse(file, 0,
           std::string("cannot be opened (") + std::strerror(e) +
               "); check the path and its permissions");
  }
  std::string text;
  std::array<char, 1U << 16U> block;
  // Reserving avoids the doubling of a growing string.
  if (const auto size = std::filesystem::file_size(file, ignored); !ignored && size <= limit)
    text.reserve(size);
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > limit)
      refuse(file, 0,
             "is longer than " + std::to_string(limit) + " bytes; check that it is the right file");
  }
  if (in.bad()) refuse(file, 0, "could not be read to its end; check the disk");
  const bool min_first = text.starts_with("\xFF\xFE");
  return min_first || text.starts_with("\xFE\xFF") ? narrowed(text, min_first) : text;
}

Lines::Lines(std::string_view text, Comments comments) noexcept : rest_(text), comments_(comments) {
  if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
}

bool Lines::next(std::string_view* line) noexcept {
  while (!rest_.empty()) {
    const std::size_t end = rest_.find('\n');
    const std::string_view raw = rest_.substr(0, end);
    unfinished_ = end == std::string_view::npos;
    rest_.remove_prefix(unfinished_ ? rest_.size() : end + 1);
    ++number_;
    const std::string_view content = trimmed(raw);
    if (content.empty() || (content.front() == '#' && comments_ == Comments::skip)) continue;
    *line = content;
    return true;
  }
  return false;
}

std::size_t split(std::string_view line, char separator,
                  std::span<std::string_view> fields) noexcept {
  std::size_t count = 0;
  const auto store = [&](std::string_view field) {
    if (count < fields.size()) fields[count] = field;
    ++count;
  };
  if (separator == ' ') {
    // One set of blanks separates and ends fields; otherwise a field could be empty and the
    // loop endless.
    for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;
         at = line.find_first_not_of(kBlanks)) {
      line.remove_prefix(at);
      const std::string_view field = line.substr(0, line.find_first_of(kBlanks));
      store(field);
      line.remove_prefix(field.size());
    }
    return count;
  }
  for (;;) {
    const std::size_t end = line.find(separator);
    store(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return count;
    line.remove_prefix(end + 1);
  }
}

bool parse_number(std::string_view field, double* value) noexcept {
  if (field.size() > 1 && field.front() == '+' && field[1] != '-') field.remove_prefix(1);
  double v = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), v);
  if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(v)) return false;
  *value = v;
  return true;
}

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
