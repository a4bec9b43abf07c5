#include "app/datasets/text_file.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <system_error>

#include "app/datasets/decimal.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kBlanks = " \t\r\v\f";

/// Converts UTF-16, of which some editors write either byte order. Characters beyond ASCII become
/// question marks, because no number, key or name that is read here contains them.
std::string narrowed(const std::string& wide, bool min_first) {
  std::string text;
  text.reserve(wide.size() / 2);
  for (std::size_t i = 2; i + 1 < wide.size(); i += 2) {
    const char low = wide[i + (min_first ? 0 : 1)], high = wide[i + (min_first ? 1 : 0)];
    text.push_back(high == 0 && static_cast<signed char>(low) >= 0 ? low : '?');
  }
  return text;
}

}  // namespace

void refuse(const std::filesystem::path& file, std::size_t line, std::string_view what) {
  std::string message = file.string();
  if (line > 0) message += ":" + std::to_string(line);
  message += ": ";
  message += what;
  throw InputError(message);
}

std::string read_text(const std::filesystem::path& file, std::size_t limit) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (std::filesystem::is_directory(status)) refuse(file, 0, "is a directory; name a file");
  // Reading a pipe would block indefinitely.
  if (std::filesystem::is_other(status))
    refuse(file, 0, "is a pipe or a device; name a regular file");
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    const int e = errno;
    refuse(file, 0,
           std::string("cannot be opened (") + std::strerror(e) +
               "); check the path and its permissions");
  }
  std::string text;
  std::array<char, 1U << 16U> block;
  // Reserving avoids the doubling of a growing string.
  if (const auto size = std::filesystem::file_size(file, ignored); !ignored && size <= limit)
    text.reserve(size);
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > limit)
      refuse(file, 0,
             "is longer than " + std::to_string(limit) + " bytes; check that it is the right file");
  }
  if (in.bad()) refuse(file, 0, "could not be read to its end; check the disk");
  const bool min_first = text.starts_with("\xFF\xFE");
  return min_first || text.starts_with("\xFE\xFF") ? narrowed(text, min_first) : text;
}

Lines::Lines(std::string_view text) noexcept : rest_(text) {
  if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
}

bool Lines::next(std::string_view* line) noexcept {
  while (!rest_.empty()) {
    const std::size_t end = rest_.find('\n');
    const std::string_view raw = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++number_;
    const std::string_view content = trimmed(raw);
    if (content.empty() || content.front() == '#') continue;
    *line = content;
    return true;
  }
  return false;
}

std::size_t split(std::string_view line, char separator,
                  std::span<std::string_view> fields) noexcept {
  std::size_t count = 0;
  const auto store = [&](std::string_view field) {
    if (count < fields.size()) fields[count] = field;
    ++count;
  };
  if (separator == ' ') {
    // One set of blanks separates and ends fields; otherwise a field could be empty and the
    // loop endless.
    for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;
         at = line.find_first_not_of(kBlanks)) {
      line.remove_prefix(at);
      const std::string_view field = line.substr(0, line.find_first_of(kBlanks));
      store(field);
      line.remove_prefix(field.size());
    }
    return count;
  }
  for (;;) {
    const std::size_t end = line.find(separator);
    store(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return count;
    line.remove_prefix(end + 1);
  }
}

bool parse_number(std::string_view field, double* value) noexcept {
  if (field.size() > 1 && field.front() == '+' && field[1] != '-') field.remove_prefix(1);
  double v = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), v);
  if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(v)) return false;
  *value = v;
  return true;
}

}  // namespace vergence::app
