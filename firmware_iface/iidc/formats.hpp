#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

/// Video formats: fixed modes of formats 0 to 2, and arithmetic of Format 7.
namespace vergence::iidc {

/// The number is the COLOR_CODING_ID.
enum class ColorCoding : std::uint8_t {
  mono8 = 0,
  yuv411 = 1,
  yuv422 = 2,
  yuv444 = 3,
  rgb8 = 4,
  mono16 = 5,
  rgb16 = 6,
  mono16_signed = 7,
  rgb16_signed = 8,
  raw8 = 9,
  raw16 = 10,
};
inline constexpr unsigned kColorCodings = 11;
/// Name such as Mono8 or YUV411.
[[nodiscard]] std::string_view to_string(ColorCoding) noexcept;
[[nodiscard]] std::optional<ColorCoding> color_coding(std::string_view name) noexcept;
[[nodiscard]] unsigned bits_per_pixel(ColorCoding) noexcept;

/// Mode of formats 0 to 2.
struct FixedMode {
  std::uint8_t format = 0, mode = 0;
  std::uint16_t width = 0, height = 0;
  ColorCoding coding = ColorCoding::mono8;
};
[[nodiscard]] std::span<const FixedMode> fixed_modes() noexcept;
[[nodiscard]] std::size_t frame_bytes(unsigned width, unsigned height, ColorCoding coding) noexcept;

inline constexpr unsigned kRates = 8;
/// Frame rate in Hz of a rate code: 1.875 · 2^code.
[[nodiscard]] constexpr double rate_of(unsigned code) noexcept {
  return 1.875 * static_cast<double>(1U << code);
}

/// Packet size of a fixed mode in bytes; 0 if it is not a whole number of quadlets, so that the
/// rate does not exist. A frame at 30 Hz has 240 packets, or 256 with 768 lines, because packets
/// carry whole fractions of lines.
[[nodiscard]] std::size_t fixed_packet_bytes(const FixedMode& mode, unsigned rate_code) noexcept;

/// Each cycle carries one packet of every camera.
inline constexpr double kCyclesPerSecond = 8000;

[[nodiscard]] constexpr std::size_t packets_for(std::size_t bytes,
                                                std::size_t packet_bytes) noexcept {
  return packet_bytes == 0 ? 0 : (bytes + packet_bytes - 1) / packet_bytes;
}
/// Highest frame rate for packets of this size, with one cycle between two frames.
[[nodiscard]] double packet_rate(std::size_t image_bytes, std::size_t packet_bytes) noexcept;
/// Smallest packet size, a multiple of `unit`, with packet_rate ≥ rate; 0 if there is none up to
/// `most`.
[[nodiscard]] std::size_t packet_for_rate(std::size_t image_bytes, double rate_hz, std::size_t unit,
                                          std::size_t most) noexcept;

/// True if Point Grey's colour filter register has a mosaic's first two rows in four letters;
/// `YYYY` or 0 is mono.
[[nodiscard]] bool is_bayer_tile(std::uint32_t quadlet) noexcept;

}  // namespace vergence::iidc
