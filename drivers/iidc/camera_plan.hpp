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
  /// True for 8 bits behind a Bayer filter.
  bool mosaic = false;
  /// Effective bits of 16-bit pixels, 8 to 16, in the low bits.
  unsigned effective_bits = 16;
  /// True if the received bytes are the image.
  [[nodiscard]] bool none() const noexcept {
    return !mosaic && (coding == ColorCoding::mono8 || coding == ColorCoding::raw8);
  }
  /// Returns true if a mode was found.
  [[nodiscard]] bool possible() const noexcept;
};

/// Converts width × height pixels into rows of `stride` bytes in one pass.
///
/// A mosaic uses bayer_to_grey(). Of 16 bits the eight highest effective ones are kept; of YUV
/// 4:2:2 the luma. Preconditions: conversion.possible() and not none(); a mosaic has at least two
/// rows and columns; `in` holds frame_bytes(width, height, coding).
void to_grey(const GreyConversion& conversion, const std::uint8_t* in, int width, int height,
             std::uint8_t* out, std::size_t stride) noexcept;

/// Plan of a camera's configuration: mode, packets and embedded information.
struct CameraPlan {
  Options options{};
  CameraTrigger trigger = CameraTrigger::hardware;
  /// IIDC trigger mode, 0 or 14.
  unsigned trigger_mode = 0;
  unsigned format = 0, mode = 0;
  /// Rate code, used by formats 0 to 2.
  unsigned rate_code = 0;
  /// Address of the mode's registers, used by Format 7.
  std::uint64_t csr = 0;
  Size size{}, position{};
  ColorCoding coding = ColorCoding::mono8;
  double requested_rate_hz = 0;
  // Values rounded by the camera, valid once the plan is applied.
  double rate_hz = 0;
  Duration exposure{};
  double gain_db = 0;
  StreamShape shape{};
  GreyConversion grey{};
  FrameInfoLayout info{};
};

/// Finds a mode: the fixed one of that size and rate, else a region of Format 7, with the cheapest
/// pixels that give grey. Only reads registers. On failure *error says what the camera offers. →
/// ok, unsupported, bad_configuration, or a register's failure
[[nodiscard]] DeviceStatus make_plan(CameraRegisters* registers, const BusTraits& bus,
                                     const CameraConfiguration& requested, CameraPlan* plan,
                                     std::string* error);

/// Stops the camera, writes the plan and fills in the values that the camera applied. The camera
/// does not transmit yet. On failure *error has the reason. → ok, unsupported, or a register's
/// failure
[[nodiscard]] DeviceStatus apply_plan(CameraRegisters* registers, const BusTraits& bus,
                                      CameraPlan* plan, std::string* error);

}  // namespace vergence::iidc
