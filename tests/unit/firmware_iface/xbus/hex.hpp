#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace vergence::xbus {

/// "FA FF 30 00 D1" or "faff3000d1" → bytes; throws where something else stands.
[[nodiscard]] inline std::vector<std::uint8_t> from_hex(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\r'; });
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

}  // namespace vergence::xbus
