#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#include "drivers/camera.hpp"
#include "drivers/iidc/camera_registers.hpp"
#include "drivers/options/iidc_options.hpp"
#include "firmware_iface/iidc/formats.hpp"

namespace vergence::iidc {

/// Conversion of a transmitted image to 8-bit grey.
struct GreyConversion {
  ColorCoding coding = ColorCoding::mono8;
  bool mosaic = false;           // 8 bits behind a Bayer filter
  unsigned effective_bits = 16;  // of 16-bit pixels, in the low bits; 8 … 16
  /// Nothing to do: the transport's bytes are the image.
  [[nodiscard]] bool none() const noexcept {
    return !mosaic && (coding == ColorCoding::mono8 || coding == ColorCoding::raw8);
  }
  /// Returns true if a mode was found.
  [[nodiscard]] bool possible() const noexcept;
};

/// Converts width × height pixels, rows of `stride` bytes in `out`.
///
/// Method  Mosaic: bayer_to_grey(). 16 bits: the eight highest of the effective ones. YUV 4:2:2:
///         the luma.
/// Time    One pass. Memory: none beside the images.
/// Precondition  conversion.possible() and not none(); a mosaic has at least two rows and columns;
///               `in` holds frame_bytes(width, height, coding).
void to_grey(const GreyConversion& conversion, const std::uint8_t* in, int width, int height,
             std::uint8_t* out, std::size_t stride) noexcept;

/// Plan for one camera's configuration: the mode, its packets, what is embedded.
struct CameraPlan {
  Options options{};
  CameraTrigger trigger = CameraTrigger::hardware;
  unsigned trigger_mode = 0;  // 0 or 14
  unsigned format = 0, mode = 0;
  unsigned rate_code = 0;  // formats 0 to 2
  std::uint64_t csr = 0;   // Format 7
  Size size{}, position{};
  ColorCoding coding = ColorCoding::mono8;
  double requested_rate_hz = 0;
  // As the camera rounds them, once applied:
  double rate_hz = 0;
  Duration exposure{};
  double gain_db = 0;
  StreamShape shape{};
  GreyConversion grey{};
  FrameInfoLayout info{};
};

/// Finds a mode for it: the fixed one of that size and rate, else a region of Format 7; the
/// cheapest pixels that give grey first. Only reads registers. → ok, unsupported,
/// bad_configuration, or why a register failed; then *error says what the camera offers.
[[nodiscard]] DeviceStatus make_plan(CameraRegisters* registers, const BusTraits& bus,
                                     const CameraConfiguration& requested, CameraPlan* plan,
                                     std::string* error);

/// Stops the camera and writes the plan into it; fills in what the camera made of it. The camera
/// stays quiet.
/// → ok, unsupported, or why a register failed; then *error says it.
[[nodiscard]] DeviceStatus apply_plan(CameraRegisters* registers, const BusTraits& bus,
                                      CameraPlan* plan, std::string* error);

}  // namespace vergence::iidc
