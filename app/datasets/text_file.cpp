#include "app/datasets/text_file.hpp"

#include <cmath>
#include <iterator>
#include <limits>

#include "app/datasets/detail/names.hpp"
#include "app/datasets/image_file.hpp"
#include "app/datasets/times_file.hpp"

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

/// Returns a comment without its marker; nullopt if the line is none.
std::size_t comment_mark(std::string_view line) noexcept {
  if (line.starts_with('#') || line.starts_with('%')) return 1;
  return line.starts_with("//") ? 2 : 0;
}

/// True for a number, or for a placeholder such as NaN.
bool begins_row(std::string_view field) {
  double ignored = 0;
  const std::string_view magnitude = field.substr(field.starts_with('-') ? 1 : 0);
  // Decimal commas are accepted here, because put_decimal_points() replaces them later.
  const std::string_view before = field.substr(0, field.find(','));
  return detail::lower(magnitude) == "nan" || parse_number(before, &ignored) ||
         parse_decimal(field, 0) || parse_iso_time(field) ||
         // This is a date that its time follows.
         (field.size() == 10 && field[4] == '-' && field[7] == '-') || is_image_name(field);
}

}  // namespace

std::string read_text(const std::filesystem::path& file, std::size_t limit) {
  std::string text = read_bytes(file, limit);
  const bool min_first = text.starts_with("\xFF\xFE");
  if (min_first || text.starts_with("\xFE\xFF")) return narrowed(text, min_first);
  return text;
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
  if (!parse_whole(field, &v) || !std::isfinite(v)) return false;
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
  if (kept > 0 && !parse_whole(digits, &value)) return std::nullopt;
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
  constexpr std::string_view kWhitespace = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kWhitespace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kWhitespace) - first + 1);
}

TextTable::TextTable(std::string_view text) : lines_(text, Lines::Comments::keep) {
  // In lines.
  constexpr std::size_t kMaxHeadings = 50;
  std::string_view headings, line;
  Lines before = lines_;
  for (std::size_t others = 0; lines_.next(&line); before = lines_) {
    if (const std::size_t mark = comment_mark(line); mark > 0) {
      headings = trimmed(line.substr(mark));
      continue;
    }
    separator_ = line.find(';') != std::string_view::npos   ? ';'
                 : line.find(',') != std::string_view::npos ? ','
                                                            : ' ';
    split_into(line, &fields_);
    if (!fields_.empty() && begins_row(fields_.front())) break;
    headings = line;
    // The text is no table.
    if (++others > kMaxHeadings) lines_ = Lines("");
  }
  // The first row is read again.
  lines_ = before;
  const char of_rows = separator_;
  if (headings.find(',') != std::string_view::npos) separator_ = ',';
  if (headings.find(';') != std::string_view::npos) separator_ = ';';
  split_into(headings, &names_);
  separator_ = of_rows;
  fields_.clear();
}

bool TextTable::next() {
  for (std::string_view line; lines_.next(&line);) {
    if (comment_mark(line) > 0) continue;
    split_into(line, &fields_);
    return true;
  }
  return false;
}

void TextTable::split_into(std::string_view line, std::vector<std::string_view>* fields) const {
  // A separator at the end adds no field.
  if (line.ends_with(separator_)) line.remove_suffix(1);
  fields->resize(split(line, separator_, {}));
  (void)split(line, separator_, *fields);
  for (std::string_view& field : *fields)
    if (field.size() > 1 && field.front() == '"' && field.back() == '"')
      field = field.substr(1, field.size() - 2);
  if (separator_ != ' ' && fields->back().empty()) fields->pop_back();
}

void put_decimal_points(std::string* text) {
  TextTable table(*text);
  if (table.separator() != ';' || !table.next()) return;
  const auto any_has = [&table](char sign) {
    return std::ranges::any_of(table.fields(), [sign](std::string_view field) {
      return field.find(sign) != std::string_view::npos;
    });
  };
  if (any_has(',') && !any_has('.')) std::ranges::replace(*text, ',', '.');
}

}  // namespace vergence::app
