#include "app/doctor/serial_kind.hpp"

#include <algorithm>
#include <array>

namespace vergence::app {
namespace {

constexpr std::uint16_t kFtdi = 0x0403, kXsens = 0x2639;

/// XSens' products under FTDI's vendor id, as in udev/99-vergence.rules.
constexpr bool is_xsens_of_ftdi(std::uint16_t product) noexcept {
  return product >= 0xD388 && product <= 0xD38F;
}

constexpr std::array<std::uint16_t, 2> kConverterMakers{0x10C4, 0x067B};  // Silicon Labs, Prolific

/// Makers of boards that bring USB with them, or a converter that hardly anything else has.
constexpr std::array<std::uint16_t, 9> kBoardMakers{
    0x2341,  // Arduino
    0x2A03,  // Arduino (dog hunter)
    0x16C0,  // Teensy, and others of that shared id
    0x2E8A,  // Raspberry Pi: Pico
    0x0483,  // STMicroelectronics: virtual COM port, ST-Link
    0x239A,  // Adafruit
    0x303A,  // Espressif
    0x1B4F,  // SparkFun
    0x1A86,  // QinHeng: the CH340 of cheap boards
};

}  // namespace

const char* to_phrase(SerialKind kind) noexcept {
  switch (kind) {
    case SerialKind::ins:
      return "XSens MTi";
    case SerialKind::ftdi:
      return "FTDI converter (an INS?)";
    case SerialKind::converter:
      return "USB converter";
    case SerialKind::board:
      return "microcontroller board (trigger board?)";
    case SerialKind::built_in:
      return "built-in port";
    case SerialKind::unknown:
      break;
  }
  return "unknown";
}

const char* to_key(SerialKind kind) noexcept {
  switch (kind) {
    case SerialKind::ins:
      return "ins";
    case SerialKind::ftdi:
      return "ftdi";
    case SerialKind::converter:
      return "converter";
    case SerialKind::board:
      return "board";
    case SerialKind::built_in:
      return "built_in";
    case SerialKind::unknown:
      break;
  }
  return "unknown";
}

SerialKind serial_kind(std::uint16_t vendor, std::uint16_t product) noexcept {
  if (vendor == 0) return SerialKind::built_in;
  if (vendor == kXsens || (vendor == kFtdi && is_xsens_of_ftdi(product))) return SerialKind::ins;
  if (vendor == kFtdi) return SerialKind::ftdi;
  if (std::find(kConverterMakers.begin(), kConverterMakers.end(), vendor) != kConverterMakers.end())
    return SerialKind::converter;
  if (std::find(kBoardMakers.begin(), kBoardMakers.end(), vendor) != kBoardMakers.end())
    return SerialKind::board;
  return SerialKind::unknown;
}

bool is_ftdi(std::uint16_t vendor, std::uint16_t product) noexcept {
  return vendor == kFtdi ||
         (vendor == kXsens && (product == 0x0300 || product == 0x0301 || product == 0xD00D));
}

}  // namespace vergence::app
