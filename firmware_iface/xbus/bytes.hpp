#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

/// Big-endian numbers of Xbus payloads. Precondition: the span is at least as long as the type.
namespace vergence::xbus {

[[nodiscard]] constexpr std::uint16_t read_u16(std::span<const std::uint8_t> b) noexcept {
  return static_cast<std::uint16_t>((b[0] << 8U) | b[1]);
}
[[nodiscard]] constexpr std::uint32_t read_u32(std::span<const std::uint8_t> b) noexcept {
  return (static_cast<std::uint32_t>(b[0]) << 24U) | (static_cast<std::uint32_t>(b[1]) << 16U) |
         (static_cast<std::uint32_t>(b[2]) << 8U) | b[3];
}
[[nodiscard]] constexpr std::uint64_t read_u64(std::span<const std::uint8_t> b) noexcept {
  return (static_cast<std::uint64_t>(read_u32(b)) << 32U) | read_u32(b.subspan(4));
}
[[nodiscard]] constexpr std::int32_t read_i32(std::span<const std::uint8_t> b) noexcept {
  return static_cast<std::int32_t>(read_u32(b));
}
[[nodiscard]] constexpr double read_float32(std::span<const std::uint8_t> b) noexcept {
  return static_cast<double>(std::bit_cast<float>(read_u32(b)));
}
[[nodiscard]] constexpr double read_float64(std::span<const std::uint8_t> b) noexcept {
  return std::bit_cast<double>(read_u64(b));
}
/// Format 12.20: a signed 32-bit count of 2⁻²⁰, range ±2048.
[[nodiscard]] constexpr double read_fp12_20(std::span<const std::uint8_t> b) noexcept {
  return static_cast<double>(read_i32(b)) / 1048576.0;
}
/// Format 16.32: the 32-bit fraction, then the signed 16-bit integer part; a double holds its 48
/// bits exactly.
[[nodiscard]] constexpr double read_fp16_32(std::span<const std::uint8_t> b) noexcept {
  return static_cast<double>(static_cast<std::int16_t>(read_u16(b.subspan(4)))) +
         static_cast<double>(read_u32(b)) / 4294967296.0;
}

constexpr void write_u16(std::span<std::uint8_t> b, std::uint16_t v) noexcept {
  b[0] = static_cast<std::uint8_t>(v >> 8U);
  b[1] = static_cast<std::uint8_t>(v);
}
constexpr void write_u32(std::span<std::uint8_t> b, std::uint32_t v) noexcept {
  write_u16(b, static_cast<std::uint16_t>(v >> 16U));
  write_u16(b.subspan(2), static_cast<std::uint16_t>(v));
}
constexpr void write_u64(std::span<std::uint8_t> b, std::uint64_t v) noexcept {
  write_u32(b, static_cast<std::uint32_t>(v >> 32U));
  write_u32(b.subspan(4), static_cast<std::uint32_t>(v));
}

/// Encoding of floating-point numbers: the lowest two bits of a packet's id (MTData2), bits 8 and 9
/// of the output settings (MTData).
enum class NumberFormat : std::uint8_t { float32 = 0, fp12_20 = 1, fp16_32 = 2, float64 = 3 };

/// Size of one number in bytes.
[[nodiscard]] constexpr std::size_t size_of(NumberFormat format) noexcept {
  return format == NumberFormat::fp16_32 ? 6 : format == NumberFormat::float64 ? 8 : 4;
}

[[nodiscard]] constexpr double read_number(std::span<const std::uint8_t> b,
                                           NumberFormat format) noexcept {
  switch (format) {
    case NumberFormat::float32:
      return read_float32(b);
    case NumberFormat::fp12_20:
      return read_fp12_20(b);
    case NumberFormat::fp16_32:
      return read_fp16_32(b);
    case NumberFormat::float64:
      return read_float64(b);
  }
  // Not reached, because two bits have four values.
  return 0;
}

/// Rounds to the format and clamps to the range of a fixed-point format. NaN becomes 0 in fixed
/// point.
void write_number(std::span<std::uint8_t> b, NumberFormat format, double value) noexcept;

}  // namespace vergence::xbus
