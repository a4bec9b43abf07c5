#include "app/datasets/text_table.hpp"

#include "app/datasets/detail/names.hpp"
#include "app/datasets/image_file.hpp"
#include "app/datasets/times_file.hpp"

namespace vergence::app {
namespace {

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
