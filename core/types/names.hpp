#pragma once
#include <array>
#include <cstddef>

namespace vergence {

/// Name of a value of an enumeration that counts from 0; empty if the value is out of range.
template <typename Enum, std::size_t N>
[[nodiscard]] constexpr const char* name_of(Enum value,
                                            const std::array<const char*, N>& names) noexcept {
  const auto k = static_cast<std::size_t>(value);
  return k < N ? names[k] : "";
}

}  // namespace vergence
