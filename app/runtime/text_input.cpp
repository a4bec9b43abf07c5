#include "app/runtime/text_input.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "app/runtime/errors.hpp"

namespace vergence::app {

void refuse(const std::filesystem::path& file, std::size_t line, std::string_view what) {
  std::string message = file.string();
  if (line > 0) message += ":" + std::to_string(line);
  message += ": ";
  message += what;
  throw InputError(message);
}

std::string read_bytes(const std::filesystem::path& file, std::size_t limit) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (std::filesystem::is_directory(status)) refuse(file, 0, "is a directory; name a file");
  // Reading a pipe would block indefinitely.
  if (std::filesystem::is_other(status))
    refuse(file, 0, "is a pipe or a device; name a regular file");
  std::ifstream in(file, std::ios::binary);
  if (!in)
    refuse(file, 0, "cannot be opened ({}); check the path and its permissions",
           std::strerror(errno));
  std::string text;
  std::array<char, 1U << 16U> block;
  // Reserving avoids the doubling of a growing string.
  if (const auto size = std::filesystem::file_size(file, ignored); !ignored && size <= limit)
    text.reserve(size);
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > limit)
      refuse(file, 0, "is longer than {} bytes; check that it is the right file", limit);
  }
  if (in.bad()) refuse(file, 0, "could not be read to its end; check the disk");
  return text;
}

}  // namespace vergence::app
