#include "app/datasets/text_table.hpp"

#include <algorithm>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/image_file.hpp"
#include "app/datasets/stamp_text.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

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

TextTable::TextTable(std::string_view text) : rest_(text) {
  // In lines.
  constexpr std::size_t kMaxHeadings = 50;
  if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
  std::string_view headings;
  for (std::size_t others = 0;;) {
    const std::string_view before = rest_;
    const std::size_t number = number_;
    std::string_view line;
    if (!next_line(&line)) break;
    if (const std::size_t mark = comment_mark(line); mark > 0) {
      headings = trimmed(line.substr(mark));
      continue;
    }
    separator_ = line.find(';') != std::string_view::npos   ? ';'
                 : line.find(',') != std::string_view::npos ? ','
                                                            : ' ';
    split_into(line, &fields_);
    if (!fields_.empty() && begins_row(fields_.front())) {
      rest_ = before;
      number_ = number;
      break;
    }
    headings = line;
    // The text is no table.
    if (++others > kMaxHeadings) rest_ = {};
  }
  const char of_rows = separator_;
  if (headings.find(',') != std::string_view::npos) separator_ = ',';
  if (headings.find(';') != std::string_view::npos) separator_ = ';';
  split_into(headings, &names_);
  separator_ = of_rows;
  fields_.clear();
}

bool TextTable::next_line(std::string_view* line) {
  while (!rest_.empty()) {
    const std::size_t end = rest_.find('\n');
    *line = trimmed(rest_.substr(0, end));
    unfinished_ = end == std::string_view::npos;
    rest_.remove_prefix(unfinished_ ? rest_.size() : end + 1);
    ++number_;
    if (!line->empty()) return true;
  }
  return false;
}

bool TextTable::next() {
  for (std::string_view line; next_line(&line);) {
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
  const auto has = [](char sign) {
    return [sign](std::string_view field) { return field.find(sign) != std::string_view::npos; };
  };
  const auto& fields = table.fields();
  if (std::ranges::any_of(fields, has(',')) && std::ranges::none_of(fields, has('.')))
    std::ranges::replace(*text, ',', '.');
}

}  // namespace vergence::app
