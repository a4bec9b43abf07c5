#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

/// Text that comes from outside: lines and numbers, every fault said with file:line.
namespace vergence::app {

/// "FILE:LINE: WHAT" as an InputError; without a line when `line` is 0.
[[noreturn]] void refuse(const std::filesystem::path& file, std::size_t line,
                         std::string_view what);

/// All bytes of a file; one of UTF-16, by its byte order mark, as ASCII. InputError: not there, a
/// folder, not readable, longer than `limit` bytes.
[[nodiscard]] std::string read_text(const std::filesystem::path& file,
                                    std::size_t limit = std::size_t{1} << 30U);

/// The lines of a text one after the other, ends LF or CR LF, a byte order mark skipped. Views into
/// `text`, which must outlive it.
class Lines {
 public:
  explicit Lines(std::string_view text) noexcept;
  /// False at the end. Lines that are empty, blank or begin with `#` are passed over but counted.
  [[nodiscard]] bool next(std::string_view* line) noexcept;
  /// Number of the line last given, from 1.
  [[nodiscard]] std::size_t number() const noexcept { return number_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

/// Splits at the separator (' ' stands for any run of blanks and tabs). Returns how many fields
/// there are; at most fields.size() are stored.
[[nodiscard]] std::size_t split(std::string_view line, char separator,
                                std::span<std::string_view> fields) noexcept;

/// The whole field is one finite number. False: *value as it was.
[[nodiscard]] bool parse_number(std::string_view field, double* value) noexcept;

}  // namespace vergence::app
