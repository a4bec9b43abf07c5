#pragma once
#include <array>
#include <cstdio>
#include <string>

namespace vergence {

/// Formats like printf into a string of at most 319 bytes; longer text is cut. For messages outside
/// the real-time path.
template <class... Args>
[[nodiscard]] std::string format_text(const char* format, Args... args) {
  std::array<char, 320> text{};
  (void)std::snprintf(text.data(), text.size(), format, args...);
  return text.data();
}

}  // namespace vergence
