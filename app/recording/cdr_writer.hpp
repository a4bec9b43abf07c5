#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

#include "core/types/time.hpp"

namespace vergence::app {

/// Writes little-endian values into a caller's buffer, as MCAP requires. Once a value does not fit,
/// ok() is false and nothing more is written. Does not allocate.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::uint8_t> room) noexcept : room_(room) {}

  template <class T>
  ByteWriter& put(T value) noexcept {
    static_assert(std::is_arithmetic_v<T>);
    return bytes(&value, sizeof value);
  }
  ByteWriter& bytes(const void* data, std::size_t size) noexcept {
    if (size > room_.size() - at_) {
      ok_ = false;
      room_ = room_.first(at_);
      return *this;
    }
    if (size > 0) std::memcpy(room_.data() + at_, data, size);
    at_ += size;
    return *this;
  }
  /// Writes a length of four bytes and the text.
  ByteWriter& text(std::string_view s) noexcept {
    return put(static_cast<std::uint32_t>(s.size())).bytes(s.data(), s.size());
  }
  /// Overwrites a value at offset `at`.
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

/// Writes a ROS 2 message as CDR (XCDR1, little endian) into a caller's buffer. Values are aligned
/// to their size, relative to the end of the four encapsulation bytes.
///
/// Replaces Fast CDR, which reports missing room by an exception, requires containers for texts and
/// sequences, and leaves padding uninitialised. Does not allocate; errors as in ByteWriter.
class CdrWriter {
 public:
  explicit CdrWriter(std::span<std::uint8_t> room) noexcept : out_(room) {
    constexpr std::array<std::uint8_t, 4> kLittleEndian{0, 1, 0, 0};
    out_.bytes(kLittleEndian.data(), kLittleEndian.size());
  }

  template <class T>
  CdrWriter& put(T value) noexcept {
    align(sizeof value);
    out_.put(value);
    return *this;
  }
  CdrWriter& boolean(bool value) noexcept { return put(static_cast<std::uint8_t>(value)); }
  /// Writes the length including the final 0, the text and the 0.
  CdrWriter& text(std::string_view s) noexcept {
    put(static_cast<std::uint32_t>(s.size() + 1));
    out_.bytes(s.data(), s.size());
    out_.put(std::uint8_t{0});
    return *this;
  }
  /// Writes the items of an array of fixed length.
  template <class T, std::size_t N>
  CdrWriter& items(const std::array<T, N>& values) noexcept {
    for (const T& v : values) put(v);
    return *this;
  }
  /// Writes the number of items of a sequence.
  CdrWriter& count(std::size_t items) noexcept { return put(static_cast<std::uint32_t>(items)); }
  CdrWriter& raw(std::span<const std::uint8_t> bytes) noexcept {
    out_.bytes(bytes.data(), bytes.size());
    return *this;
  }
  /// Writes a builtin_interfaces/Time. Seconds are rounded down, so times before 1970 are correct,
  /// and clamped to 32 bits (2038).
  CdrWriter& time(Stamp stamp) noexcept {
    constexpr std::int64_t kSecond = 1'000'000'000;
    std::int64_t seconds = stamp.ns() / kSecond, ns = stamp.ns() % kSecond;
    if (ns < 0) --seconds, ns += kSecond;
    put(static_cast<std::int32_t>(std::clamp<std::int64_t>(seconds, INT32_MIN, INT32_MAX)));
    return put(static_cast<std::uint32_t>(ns));
  }
  /// Writes a std_msgs/Header.
  CdrWriter& header(Stamp stamp, std::string_view frame) noexcept {
    return time(stamp).text(frame);
  }
  [[nodiscard]] bool ok() const noexcept { return out_.ok(); }
  [[nodiscard]] std::size_t size() const noexcept { return out_.size(); }
  [[nodiscard]] std::span<const std::uint8_t> written() const noexcept { return out_.written(); }

 private:
  void align(std::size_t size) noexcept {
    constexpr std::array<std::uint8_t, 8> kZeros{};
    const std::size_t over = (out_.size() - 4) % size;
    if (over != 0) out_.bytes(kZeros.data(), size - over);
  }

  ByteWriter out_;
};

/// The code copies values in host byte order.
static_assert(std::endian::native == std::endian::little, "values are copied as they are");

}  // namespace vergence::app
