#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vergence::app::report {

/// The lines of a file one after the other as Lines gives those of a text, whatever the file's
/// length. What follows the last line's end is left out: a killed writer leaves it, and a number
/// cut in the middle looks like another one.
///
/// Memory  A block, or the longest line; of a line beyond kLongestLine some bytes are lost, so that
///         it is a damaged one.
/// Errors  The constructor throws InputError: not there, no file, not readable.
class FileLines {
 public:
  static constexpr std::size_t kLongestLine = std::size_t{1} << 20U;  // bytes

  explicit FileLines(const std::filesystem::path& file);
  /// False at the end. The view holds until the next call.
  [[nodiscard]] bool next(std::string_view* line);
  /// At the end: the file does not end with a line's end.
  [[nodiscard]] bool torn() const noexcept { return torn_; }
  /// At the end: the rest could not be read.
  [[nodiscard]] bool failed() const noexcept { return in_.bad(); }

 private:
  [[nodiscard]] bool next_whole(std::string_view* line);
  [[nodiscard]] bool read_block();

  std::ifstream in_;
  std::string read_{};  // and not given yet, from at_ on
  std::size_t at_ = 0;
  bool begun_ = false, torn_ = false;
};

/// Rows of a table whose first line names the columns, commas between, nothing quoted: what the
/// recorder writes.
///
/// Ownership  Fields are views into the line last given.
/// Errors     A row with another number of fields than the head is passed over and counted.
class CsvRows {
 public:
  /// Gives the next line; false at the end.
  using NextLine = std::function<bool(std::string_view*)>;
  explicit CsvRows(NextLine next_line);
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
  NextLine next_line_;
  std::vector<std::string> names_;
  std::vector<std::string_view> fields_;
  std::size_t torn_ = 0;
};

}  // namespace vergence::app::report
