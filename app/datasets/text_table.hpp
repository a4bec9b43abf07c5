#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "app/datasets/text_file.hpp"

/// Tables of numbers as programs write them.
namespace vergence::app {

/// The rows of a text, one after the other. Between fields stand commas, semicolons or blanks and
/// tabs, whichever the first row has; fields may be in double quotes; a separator at a row's end
/// ends no further field. What stands before the first row may be headings. Views into `text`,
/// which must outlive it.
class TextTable {
 public:
  explicit TextTable(std::string_view text);

  /// False at the end. Empty lines and comments (`#`, `%`, `//`) are passed over.
  [[nodiscard]] bool next();
  [[nodiscard]] const std::vector<std::string_view>& fields() const noexcept { return fields_; }
  /// Number of the last row, from 1.
  [[nodiscard]] std::size_t line() const noexcept { return number_; }
  /// The row last given is the text's last and has no end of line: its writer may have stopped in
  /// it.
  [[nodiscard]] bool unfinished() const noexcept { return unfinished_; }

  /// ',', ';' or ' '.
  [[nodiscard]] char separator() const noexcept { return separator_; }
  /// The headings of the line before the first row, also where that is a comment.
  [[nodiscard]] const std::vector<std::string_view>& names() const noexcept { return names_; }

 private:
  [[nodiscard]] bool next_line(std::string_view* line);
  void split_into(std::string_view line, std::vector<std::string_view>* fields) const;

  std::string_view rest_;
  std::size_t number_ = 0;
  bool unfinished_ = false;
  char separator_ = ' ';
  std::vector<std::string_view> names_, fields_;
};

/// Tables of some languages have semicolons between numbers like 0,25: the commas become points.
void put_decimal_points(std::string* text);

}  // namespace vergence::app
