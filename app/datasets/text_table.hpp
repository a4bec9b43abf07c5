#pragma once
#include <vector>

#include "app/datasets/text_file.hpp"

/// Tables of numbers as programs write them.
namespace vergence::app {

/// Iterates over the rows of a text. The first row determines the separator: commas, semicolons, or
/// blanks and tabs. Fields may be in double quotes; a separator at a row's end adds no field. A
/// line before the first row may have headings. Returns views of `text`, which must outlive it.
class TextTable {
 public:
  explicit TextTable(std::string_view text);

  /// Returns false at the end. Empty lines and comments (`#`, `%`, `//`) are skipped.
  [[nodiscard]] bool next();
  [[nodiscard]] const std::vector<std::string_view>& fields() const noexcept { return fields_; }
  /// Number of the last row, from 1.
  [[nodiscard]] std::size_t line() const noexcept { return lines_.number(); }
  /// True if the last row may be incomplete (Lines::unfinished()).
  [[nodiscard]] bool unfinished() const noexcept { return lines_.unfinished(); }

  /// One of ',', ';' and ' '.
  [[nodiscard]] char separator() const noexcept { return separator_; }
  /// Headings in the line before the first row, even if it is a comment.
  [[nodiscard]] const std::vector<std::string_view>& names() const noexcept { return names_; }

 private:
  void split_into(std::string_view line, std::vector<std::string_view>* fields) const;

  Lines lines_;
  char separator_ = ' ';
  std::vector<std::string_view> names_, fields_;
};

/// Replaces decimal commas by points in tables with semicolons between numbers.
void put_decimal_points(std::string* text);

}  // namespace vergence::app
