#pragma once
#include <array>
#include <cstdio>
#include <string>

namespace vergence::xsens {

/// printf into a sentence of at most 319 bytes; what is longer is cut.
template <class... Args>
std::string format_text(const char* format, Args... args) {
  std::array<char, 320> buffer{};
  (void)std::snprintf(buffer.data(), buffer.size(), format, args...);
  return buffer.data();
}

}  // namespace vergence::xsens
