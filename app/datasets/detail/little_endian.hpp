#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace vergence::app::detail {

/// Reads elements of MCAP records in sequence. Once one is incomplete, ok() is false and further
/// values are 0.
class LittleEndian {
 public:
  explicit LittleEndian(std::span<const std::uint8_t> bytes) noexcept : rest_(bytes) {}

  [[nodiscard]] std::uint64_t number(std::size_t size) noexcept {
    std::uint64_t value = 0;
    const auto b = take(size);
    for (std::size_t i = b.size(); i-- > 0;) value = value << 8U | b[i];
    return value;
  }
  [[nodiscard]] std::uint16_t u16() noexcept { return static_cast<std::uint16_t>(number(2)); }
  [[nodiscard]] std::uint32_t u32() noexcept { return static_cast<std::uint32_t>(number(4)); }
  [[nodiscard]] std::uint64_t u64() noexcept { return number(8); }
  /// Reads a length of four bytes and the text.
  [[nodiscard]] std::string text() {
    const auto b = take(u32());
    return {b.begin(), b.end()};
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }

 private:
  [[nodiscard]] std::span<const std::uint8_t> take(std::size_t size) noexcept {
    if (!ok_ || size > rest_.size()) {
      ok_ = false;
      return {};
    }
    const auto taken = rest_.first(size);
    rest_ = rest_.subspan(size);
    return taken;
  }

  std::span<const std::uint8_t> rest_;
  bool ok_ = true;
};

}  // namespace vergence::app::detail
