#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

/// External text: lines and numbers, with errors as file:line.
namespace vergence::app {

/// Throws InputError "FILE:LINE: WHAT"; without the line if `line` is 0.
[[noreturn]] void refuse(const std::filesystem::path& file, std::size_t line,
                         std::string_view what);
/// Same with a formatted message.
template <class First, class... Rest>
[[noreturn]] void refuse(const std::filesystem::path& file, std::size_t line,
                         fmt::format_string<First, Rest...> what, First&& first, Rest&&... rest) {
  refuse(file, line, fmt::format(what, std::forward<First>(first), std::forward<Rest>(rest)...));
}

/// Reads all bytes of a file; UTF-16, detected by its byte order mark, is converted to ASCII.
/// Throws InputError if it is missing, a directory, unreadable or longer than `limit` bytes.
[[nodiscard]] std::string read_text(const std::filesystem::path& file,
                                    std::size_t limit = std::size_t{1} << 30U);

/// Iterates over the lines of a text with LF or CR LF, skipping a byte order mark. Returns views of
/// `text`, which must outlive it.
class Lines {
 public:
  explicit Lines(std::string_view text) noexcept;
  /// Returns false at the end. Empty, blank and `#` lines are skipped but counted.
  [[nodiscard]] bool next(std::string_view* line) noexcept;
  /// Number of the last returned line, from 1.
  [[nodiscard]] std::size_t number() const noexcept { return number_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

/// Splits at the separator (' ' stands for any run of blanks and tabs). Returns the number of
/// fields; at most fields.size() are stored.
[[nodiscard]] std::size_t split(std::string_view line, char separator,
                                std::span<std::string_view> fields) noexcept;

/// Parses a field that is one finite number. If false, *value is unchanged.
[[nodiscard]] bool parse_number(std::string_view field, double* value) noexcept;

}  // namespace vergence::app
