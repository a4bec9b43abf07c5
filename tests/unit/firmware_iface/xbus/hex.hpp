#pragma once
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace vergence::xbus {

/// "FA FF 30 00 D1" or "faff3000d1" → bytes; throws where something else stands.
[[nodiscard]] inline std::vector<std::uint8_t> from_hex(std::string_view text) {
  std::vector<std::uint8_t> bytes;
  int digits = 0;
  unsigned value = 0;
  for (const char c : text) {
    if (c == ' ' || c == '\n' || c == '\r') continue;
    const unsigned digit = c >= '0' && c <= '9'   ? static_cast<unsigned>(c - '0')
                           : c >= 'a' && c <= 'f' ? static_cast<unsigned>(c - 'a') + 10
                           : c >= 'A' && c <= 'F' ? static_cast<unsigned>(c - 'A') + 10
                                                  : throw std::invalid_argument("no hex digit");
    value = value * 16 + digit;
    if (++digits % 2 == 0) {
      bytes.push_back(static_cast<std::uint8_t>(value));
      value = 0;
    }
  }
  if (digits % 2 != 0) throw std::invalid_argument("half a byte");
  return bytes;
}

}  // namespace vergence::xbus
