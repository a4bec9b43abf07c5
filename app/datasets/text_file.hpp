#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "app/runtime/text_input.hpp"

/// External text: lines, tables and numbers, with errors as file:line, and numbers as text.
namespace vergence::app {

/// read_bytes() of a text; UTF-16, detected by its byte order mark, is converted to ASCII.
[[nodiscard]] std::string read_text(const std::filesystem::path& file,
                                    std::size_t limit = std::size_t{1} << 30U);

/// Iterates over the lines of a text with LF or CR LF, skipping a byte order mark. Returns views of
/// `text`, which must outlive it.
class Lines {
 public:
  enum class Comments : std::uint8_t { skip, keep };
  explicit Lines(std::string_view text, Comments comments = Comments::skip) noexcept;
  /// Returns false at the end. Empty and blank lines, and those with `#`, are skipped but counted.
  [[nodiscard]] bool next(std::string_view* line) noexcept;
  /// True if the last line ends the text without an end of line, so that it may be incomplete.
  [[nodiscard]] bool unfinished() const noexcept { return unfinished_; }
  /// Number of the last returned line, from 1.
  [[nodiscard]] std::size_t number() const noexcept { return number_; }

 private:
  std::string_view rest_;
  Comments comments_;
  std::size_t number_ = 0;
  bool unfinished_ = false;
};

/// Splits at the separator (' ' stands for any run of blanks and tabs). Returns the number of
/// fields; at most fields.size() are stored.
[[nodiscard]] std::size_t split(std::string_view line, char separator,
                                std::span<std::string_view> fields) noexcept;

/// Parses a field that is one finite number. If false, *value is unchanged.
[[nodiscard]] bool parse_number(std::string_view field, double* value) noexcept;

/// Parses a decimal number times 10^decimals exactly, without a double. Further digits round half
/// away from zero. Empty if it is not a number (including blanks) or exceeds 64 bits.
[[nodiscard]] std::optional<std::int64_t> parse_decimal(std::string_view text,
                                                        int decimals) noexcept;
/// Parses seconds and returns nanoseconds (`12`, `-0.5`, `1.044989e-01`).
[[nodiscard]] std::optional<std::int64_t> parse_seconds_ns(std::string_view text) noexcept;

/// Parses the whole text as a decimal integer; empty otherwise.
[[nodiscard]] std::optional<std::int64_t> parse_integer(std::string_view text) noexcept;

/// Nanoseconds as seconds with nine decimals, such as `-0.000000001`, without rounding.
[[nodiscard]] std::string format_seconds(std::int64_t ns);
/// Appends to *line without allocating if the line has room.
void append_seconds(std::string* line, std::int64_t ns);

/// Removes blanks, tabs and carriage returns at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text) noexcept;

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
