#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "app/datasets/text_file.hpp"

namespace vergence::app::report {

/// The part of a text that ends with a line's end. A killed writer leaves the rest; a number cut in
/// the middle looks like another one.
[[nodiscard]] std::string_view whole_lines(std::string_view text) noexcept;

/// Rows of a table whose first line names the columns, commas between, nothing quoted: what the
/// recorder writes.
///
/// Ownership  Views into the text, which outlives it.
/// Errors     A row with another number of fields than the head is passed over and counted.
class CsvRows {
 public:
  explicit CsvRows(std::string_view text);
  /// Position of a column by its name; nothing when the table lacks it.
  [[nodiscard]] std::optional<std::size_t> column(std::string_view name) const noexcept;
  /// False at the end.
  [[nodiscard]] bool next();

  /// Of the row last given. Empty where the column does not exist.
  [[nodiscard]] std::string_view text(std::optional<std::size_t> column) const noexcept;
  /// Nothing: empty, or not one finite number.
  [[nodiscard]] std::optional<double> number(std::optional<std::size_t> column) const noexcept;
  [[nodiscard]] std::optional<std::int64_t> integer(
      std::optional<std::size_t> column) const noexcept;

  [[nodiscard]] bool has_head() const noexcept { return !names_.empty(); }
  [[nodiscard]] std::size_t torn_rows() const noexcept { return torn_; }

 private:
  static constexpr std::size_t kMostColumns = 256;
  Lines lines_;
  std::vector<std::string_view> names_, fields_;
  std::size_t torn_ = 0;
};

}  // namespace vergence::app::report
