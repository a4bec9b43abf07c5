#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Plain text for a terminal, a file or a pipe.
namespace vergence::app {

/// Number of columns of a text: its code points, because no wide ones are printed.
[[nodiscard]] std::size_t columns(std::string_view utf8) noexcept;
/// Pads the text with blanks to `width` columns; longer texts are unchanged.
[[nodiscard]] std::string padded(std::string_view text, std::size_t width);
/// Splits into lines of at most `width` columns at blanks; a longer word gets its own line. Returns
/// at least one line.
[[nodiscard]] std::vector<std::string> wrapped(std::string_view text, std::size_t width);

/// Length of the well-formed UTF-8 character at the front of a non-empty text; 0 if there is none.
[[nodiscard]] std::size_t utf8_length(std::string_view text);
/// Replaces unprintable characters by blanks and invalid UTF-8 by question marks, because texts of
/// devices and files must not control a terminal or corrupt JSON.
[[nodiscard]] std::string harmless(std::string_view text);

}  // namespace vergence::app
