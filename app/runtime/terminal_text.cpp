#include "app/runtime/terminal_text.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace vergence::app {

std::size_t columns(std::string_view utf8) noexcept {
  return static_cast<std::size_t>(std::count_if(utf8.begin(), utf8.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

std::string padded(std::string_view text, std::size_t width) {
  const std::size_t taken = columns(text);
  return std::string(text) + std::string(taken < width ? width - taken : 0, ' ');
}

std::vector<std::string> wrapped(std::string_view text, std::size_t width) {
  std::vector<std::string> lines(1);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (word.empty()) continue;
    std::string& line = lines.back();
    if (line.empty())
      line = word;
    else if (columns(line) + 1 + columns(word) <= width)
      line.append(1, ' ').append(word);
    else
      lines.emplace_back(word);
  }
  return lines;
}

Terminal Terminal::of_stdout() {
  constexpr std::size_t kLeast = 60, kMost = 140;
  Terminal t;
  if (::isatty(STDOUT_FILENO) == 0) return t;
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0)
    t.width = std::clamp<std::size_t>(size.ws_col, kLeast, kMost);
  const char* kind = std::getenv("TERM");
  t.colours =
      kind != nullptr && std::string_view(kind) != "dumb" && std::getenv("NO_COLOR") == nullptr;
  return t;
}

std::string Terminal::in(Ink ink, std::string_view text) const {
  if (!colours) return std::string(text);
  const char* code = ink == Ink::red      ? "31;1"
                     : ink == Ink::yellow ? "33;1"
                     : ink == Ink::green  ? "32"
                     : ink == Ink::bold   ? "1"
                                          : "2";
  return std::string("\033[") + code + "m" + std::string(text) + "\033[0m";
}

std::string harmless(std::string_view text) {
  std::string out(text);
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return out;
}

}  // namespace vergence::app
