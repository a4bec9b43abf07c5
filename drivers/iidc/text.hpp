#pragma once
#include <array>
#include <cstdio>
#include <string>

namespace vergence::iidc {

/// printf into a string of at most 255 characters: sentences with numbers, off the real-time path.
template <class... A>
std::string text(const char* format, A... values) {
  std::array<char, 256> out{};
  (void)std::snprintf(out.data(), out.size(), format, values...);
  return out.data();
}

}  // namespace vergence::iidc
