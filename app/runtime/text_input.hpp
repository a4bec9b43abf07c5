#pragma once
#include <charconv>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

/// Files and numbers from outside.
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

/// Reads all bytes of a file. Throws InputError if it is missing, a directory, a pipe, unreadable
/// or longer than `limit` bytes.
[[nodiscard]] std::string read_bytes(const std::filesystem::path& file, std::size_t limit);

/// Parses the whole text as one number, an integer also in another base than 10.
template <class Number, class... Base>
[[nodiscard]] bool parse_whole(std::string_view text, Number* value, Base... base) noexcept {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, *value, base...);
  return error == std::errc{} && stop == end;
}

}  // namespace vergence::app
