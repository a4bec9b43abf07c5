#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Plain text for people who read it on a terminal, in a file or in a pipe.
namespace vergence::app {

/// Columns that a text takes: its code points; what is printed here has no wide ones.
[[nodiscard]] std::size_t columns(std::string_view utf8) noexcept;
/// The text and blanks up to `width` columns; longer texts stay as they are.
[[nodiscard]] std::string padded(std::string_view text, std::size_t width);
/// Lines of at most `width` columns, broken at blanks; a longer word gets a line of its own. At
/// least one line.
[[nodiscard]] std::vector<std::string> wrapped(std::string_view text, std::size_t width);

/// Standard output: its width (100 where it is no terminal, at least 60), and whether colours are
/// welcome (a terminal that can, NO_COLOR unset).
struct Terminal {
  std::size_t width = 100;
  bool colours = false;
  [[nodiscard]] static Terminal of_stdout();

  enum class Ink { red, yellow, green, bold, dim };
  [[nodiscard]] std::string in(Ink ink, std::string_view text) const;
};

/// Length of the well-formed UTF-8 character at the front of a text that is not empty; 0: none.
[[nodiscard]] std::size_t utf8_length(std::string_view text);
/// Whatever is not printable becomes a blank, and bytes that are no UTF-8 become question marks:
/// texts of devices and files must not steer a terminal or spoil a JSON.
[[nodiscard]] std::string harmless(std::string_view text);

}  // namespace vergence::app
