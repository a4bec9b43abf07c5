#pragma once
#include <array>
#include <bit>
#include <cstring>
#include <type_traits>

#include "app/datasets/detail/bag_scan.hpp"
#include "core/types/time.hpp"

namespace vergence::app::detail {

/// Reads the values of a ROS message in sequence: CDR (XCDR1, either byte order), which is aligned,
/// or ROS 1, which is not. Once a value is missing, ok() is false and further values are 0. Lengths
/// are checked against the available bytes before allocation.
class RosReader {
 public:
  RosReader(std::span<const std::uint8_t> bytes, MessageEncoding encoding) noexcept
      : bytes_(bytes),
        cdr_(encoding == MessageEncoding::cdr),
        ok_(encoding != MessageEncoding::other) {
    if (!cdr_) return;
    begin_ = at_ = 4;
    ok_ = bytes.size() >= 4 && bytes[0] == 0 && bytes[1] <= 1;
    little_ = ok_ && bytes[1] == 1;
  }

  template <typename T>
  [[nodiscard]] T get() noexcept {
    static_assert(std::is_arithmetic_v<T>);
    const std::size_t unit = cdr_ ? sizeof(T) : 1;
    const std::size_t at = (at_ - begin_ + unit - 1) / unit * unit + begin_;
    T value{};
    if (!ok_ || at > bytes_.size() || sizeof(T) > bytes_.size() - at) {
      ok_ = false;
      return value;
    }
    const bool as_here = little_ == (std::endian::native == std::endian::little);
    std::array<std::uint8_t, sizeof(T)> raw{};
    for (std::size_t i = 0; i < sizeof(T); ++i)
      raw[i] = bytes_[at + (as_here ? i : sizeof(T) - 1 - i)];
    std::memcpy(&value, raw.data(), sizeof(T));
    at_ = at + sizeof(T);
    return value;
  }
  template <std::size_t N>
  [[nodiscard]] std::array<double, N> doubles() noexcept {
    std::array<double, N> values{};
    for (double& v : values) v = get<double>();
    return values;
  }
  [[nodiscard]] std::string text() {
    // In CDR the length includes the final 0.
    const auto length = get<std::uint32_t>();
    ok_ = ok_ && length <= bytes_.size() - at_;
    if (!ok_) return "";
    const auto* begin = reinterpret_cast<const char*>(bytes_.data() + at_);
    at_ += length;
    return length == 0 ? "" : std::string(begin, cdr_ ? length - 1 : length);
  }
  /// Reads a std_msgs/Header.
  [[nodiscard]] Stamp header() {
    // ROS 1 headers begin with the publisher's sequence number.
    if (!cdr_) (void)get<std::uint32_t>();
    // Seconds are signed in ROS 2 and unsigned in ROS 1.
    const auto seconds = get<std::uint32_t>(), ns = get<std::uint32_t>();
    (void)text();
    return Stamp(
        (cdr_ ? std::int64_t{static_cast<std::int32_t>(seconds)} : seconds) * 1'000'000'000 + ns);
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  /// Position relative to the message's first byte.
  [[nodiscard]] std::size_t position() const noexcept { return at_; }

 private:
  std::span<const std::uint8_t> bytes_;
  bool cdr_, little_ = true, ok_ = true;
  // End of the CDR encapsulation, to which alignment refers.
  std::size_t begin_ = 0;
  std::size_t at_ = 0;
};

}  // namespace vergence::app::detail
