#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

namespace vergence::app {

static_assert(std::endian::native == std::endian::little, "values are copied as they are");

/// Little-endian values one after the other into somebody's bytes, as MCAP wants them. Once
/// something finds no room, ok() is false and nothing more is written.
/// Memory  None.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::uint8_t> room) noexcept : room_(room) {}

  template <class T>
  void put(T value) noexcept {
    static_assert(std::is_arithmetic_v<T>);
    bytes(&value, sizeof value);
  }
  void bytes(const void* data, std::size_t size) noexcept {
    if (size > room_.size() - at_) {
      ok_ = false;
      room_ = room_.first(at_);
      return;
    }
    if (size > 0) std::memcpy(room_.data() + at_, data, size);
    at_ += size;
  }
  /// A length of four bytes and so many bytes.
  void text(std::string_view s) noexcept {
    put(static_cast<std::uint32_t>(s.size()));
    bytes(s.data(), s.size());
  }
  /// Over a value that was put at `at`.
  template <class T>
  void overwrite(std::size_t at, T value) noexcept {
    if (at + sizeof value <= at_) std::memcpy(room_.data() + at, &value, sizeof value);
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t size() const noexcept { return at_; }
  [[nodiscard]] std::span<const std::uint8_t> written() const noexcept { return room_.first(at_); }

 private:
  std::span<std::uint8_t> room_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace vergence::app
