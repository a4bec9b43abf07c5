#include "firmware_iface/iidc/formats.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace vergence::iidc {
namespace {

using C = ColorCoding;
constexpr std::array kModes{
    FixedMode{0, 0, 160, 120, C::yuv444},   FixedMode{0, 1, 320, 240, C::yuv422},
    FixedMode{0, 2, 640, 480, C::yuv411},   FixedMode{0, 3, 640, 480, C::yuv422},
    FixedMode{0, 4, 640, 480, C::rgb8},     FixedMode{0, 5, 640, 480, C::mono8},
    FixedMode{0, 6, 640, 480, C::mono16},   FixedMode{1, 0, 800, 600, C::yuv422},
    FixedMode{1, 1, 800, 600, C::rgb8},     FixedMode{1, 2, 800, 600, C::mono8},
    FixedMode{1, 3, 1024, 768, C::yuv422},  FixedMode{1, 4, 1024, 768, C::rgb8},
    FixedMode{1, 5, 1024, 768, C::mono8},   FixedMode{1, 6, 800, 600, C::mono16},
    FixedMode{1, 7, 1024, 768, C::mono16},  FixedMode{2, 0, 1280, 960, C::yuv422},
    FixedMode{2, 1, 1280, 960, C::rgb8},    FixedMode{2, 2, 1280, 960, C::mono8},
    FixedMode{2, 3, 1600, 1200, C::yuv422}, FixedMode{2, 4, 1600, 1200, C::rgb8},
    FixedMode{2, 5, 1600, 1200, C::mono8},  FixedMode{2, 6, 1280, 960, C::mono16},
    FixedMode{2, 7, 1600, 1200, C::mono16},
};

constexpr std::array<std::string_view, kColorCodings> kNames{
    "Mono8", "YUV411",       "YUV422",      "YUV444", "RGB8", "Mono16",
    "RGB16", "Mono16signed", "RGB16signed", "Raw8",   "Raw16"};
constexpr std::array<unsigned, kColorCodings> kBits{8, 12, 16, 24, 24, 16, 48, 16, 48, 8, 16};

}  // namespace

std::string_view to_string(ColorCoding c) noexcept {
  const auto i = static_cast<std::size_t>(c);
  return i < kNames.size() ? kNames[i] : std::string_view("unknown");
}

std::optional<ColorCoding> color_coding(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (kNames[i] == name) return static_cast<ColorCoding>(i);
  return std::nullopt;
}

unsigned bits_per_pixel(ColorCoding c) noexcept {
  const auto i = static_cast<std::size_t>(c);
  return i < kBits.size() ? kBits[i] : 0;
}

std::span<const FixedMode> fixed_modes() noexcept { return kModes; }

std::size_t frame_bytes(unsigned width, unsigned height, ColorCoding coding) noexcept {
  return static_cast<std::size_t>(width) * height * bits_per_pixel(coding) / 8;
}

std::size_t fixed_packet_bytes(const FixedMode& mode, unsigned rate_code) noexcept {
  if (rate_code >= kRates) return 0;
  // Packets of a frame at 240 Hz, times 2 a code below.
  const std::size_t packets = (mode.height == 768 ? 32U : 30U) << (kRates - 1 - rate_code);
  const std::size_t bytes = frame_bytes(mode.width, mode.height, mode.coding);
  if (bytes % packets != 0 || bytes / packets % 4 != 0) return 0;
  return bytes / packets;
}

double packet_rate(std::size_t image_bytes, std::size_t packet_bytes) noexcept {
  if (packet_bytes == 0 || image_bytes == 0) return 0;
  return kCyclesPerSecond / static_cast<double>(packets_for(image_bytes, packet_bytes) + 1);
}

std::size_t packet_for_rate(std::size_t image_bytes, double rate_hz, std::size_t unit,
                            std::size_t most) noexcept {
  if (!(rate_hz > 0) || unit == 0 || image_bytes == 0) return 0;
  const double packets = std::floor(kCyclesPerSecond / rate_hz * (1 + 1e-9)) - 1;
  if (!(packets >= 1)) return 0;
  const double least = std::ceil(static_cast<double>(image_bytes) / packets);
  if (least > static_cast<double>(most)) return 0;
  const std::size_t packet = (static_cast<std::size_t>(least) + unit - 1) / unit * unit;
  return packet <= most ? packet : 0;
}

bool is_bayer_tile(std::uint32_t quadlet) noexcept {
  constexpr std::array<std::uint32_t, 4> kTiles{0x52474742, 0x47524247, 0x47425247, 0x42474752};
  return std::find(kTiles.begin(), kTiles.end(), quadlet) != kTiles.end();
}

}  // namespace vergence::iidc
