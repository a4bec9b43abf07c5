#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/math/random.hpp"

namespace vergence::test {

/// Bytes changed, taken out, put in and cut off, at one to four places.
[[nodiscard]] inline std::vector<std::uint8_t> mutated(std::vector<std::uint8_t> file,
                                                       Random* random) {
  const auto any = [random](std::size_t n) {
    return static_cast<std::size_t>(random->below(static_cast<std::uint32_t>(n)));
  };
  const std::size_t changes = 1 + any(4);
  for (std::size_t i = 0; i < changes && file.size() > 16; ++i) {
    // Headers are damaged more often.
    const std::size_t at = any(any(3) == 0 ? std::min<std::size_t>(file.size(), 80) : file.size());
    const auto place = file.begin() + static_cast<std::ptrdiff_t>(at);
    switch (any(5)) {
      case 0:
        *place = static_cast<std::uint8_t>(*place ^ 1U << any(8));
        break;
      case 1:
        *place = static_cast<std::uint8_t>(any(2) == 0 ? 0xff : any(256));
        break;
      case 2:
        file.erase(place, place + static_cast<std::ptrdiff_t>(
                                      std::min<std::size_t>(1 + any(16), file.size() - at)));
        break;
      case 3:
        file.insert(place, 1 + any(16), static_cast<std::uint8_t>(any(256)));
        break;
      default:
        if (any(8) == 0) file.resize(at);
    }
  }
  return file;
}

}  // namespace vergence::test
