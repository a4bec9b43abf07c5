#pragma once
#include <cstdint>

/// Offsets from the command base (ConfigRom::command_base) and their bits.
namespace vergence::iidc {

[[nodiscard]] constexpr std::uint32_t bit(unsigned n) noexcept { return std::uint32_t{1} << n; }
/// Bits high to low of a quadlet.
[[nodiscard]] constexpr std::uint32_t field(std::uint32_t quadlet, unsigned high,
                                            unsigned low) noexcept {
  return quadlet >> low & static_cast<std::uint32_t>((std::uint64_t{1} << (high - low + 1)) - 1);
}

namespace reg {

/// Bit 31 − f stands for format f.
inline constexpr std::uint32_t kFormatInquiry = 0x100;
inline constexpr std::uint32_t kBasicFunctions = 0x400;
/// Bit 28 stands for the strobe.
inline constexpr std::uint32_t kOptionalFunctions = 0x40C;
/// Contains a quadlet offset.
inline constexpr std::uint32_t kStrobeBase = 0x48C;
inline constexpr std::uint32_t kTriggerInquiry = 0x530;

/// The value is in bits 31 to 29 of the next three registers.
inline constexpr std::uint32_t kFrameRate = 0x600;
inline constexpr std::uint32_t kVideoMode = 0x604;
inline constexpr std::uint32_t kVideoFormat = 0x608;
inline constexpr std::uint32_t kIsoChannel = 0x60C;

/// The flag is bit 31 of the next three registers. kTransmit is the standard's "ISO_EN". Writing
/// kSoftwareTrigger triggers; it reads 1 while busy.
inline constexpr std::uint32_t kPower = 0x610;
inline constexpr std::uint32_t kTransmit = 0x614;
inline constexpr std::uint32_t kSoftwareTrigger = 0x62C;
inline constexpr std::uint32_t kTriggerMode = 0x830;
// Registers of Point Grey. kBayerTile has four letters; "YYYY" is mono.
inline constexpr std::uint32_t kBayerTile = 0x1040;
inline constexpr std::uint32_t kFrameInfo = 0x12F8;

/// Bit 31 − m stands for mode m.
[[nodiscard]] constexpr std::uint32_t mode_inquiry(unsigned format) noexcept {
  return 0x180 + 4 * format;
}
/// Bit 31 − r stands for rate r.
[[nodiscard]] constexpr std::uint32_t rate_inquiry(unsigned format, unsigned mode) noexcept {
  return 0x200 + 0x20 * format + 4 * mode;
}
/// Contains a quadlet offset.
[[nodiscard]] constexpr std::uint32_t format7_base(unsigned mode) noexcept {
  return 0x2E0 + 4 * mode;
}

/// Registers of a Format 7 mode, relative to its base.
namespace format7 {
/// Width in bits 31 to 16, height in bits 15 to 0 of the next four registers.
inline constexpr std::uint32_t kMaxSize = 0x00;
inline constexpr std::uint32_t kUnitSize = 0x04;
inline constexpr std::uint32_t kPosition = 0x08;
inline constexpr std::uint32_t kSize = 0x0C;
/// Coding in bits 31 to 24.
inline constexpr std::uint32_t kCoding = 0x10;
/// Bit 31 − c stands for coding c.
inline constexpr std::uint32_t kCodingInquiry = 0x14;
inline constexpr std::uint32_t kTotalBytesLow = 0x3C;
/// Unit in bits 31 to 16, maximum in bits 15 to 0.
inline constexpr std::uint32_t kPacketLimits = 0x40;
/// Set value in bits 31 to 16, recommended one in bits 15 to 0.
inline constexpr std::uint32_t kPacketBytes = 0x44;
/// 0 means the same unit as the size.
inline constexpr std::uint32_t kUnitPosition = 0x4C;
inline constexpr std::uint32_t kValueSetting = 0x7C;
inline constexpr std::uint32_t kValuePresent = bit(31), kValueApply = bit(30),
                               kErrorRegion = bit(23), kErrorPacket = bit(22);
}  // namespace format7

/// Registers of the strobe outputs, relative to their base.
namespace strobe {
[[nodiscard]] constexpr std::uint32_t inquiry(unsigned pin) noexcept { return 0x100 + 4 * pin; }
[[nodiscard]] constexpr std::uint32_t control(unsigned pin) noexcept { return 0x200 + 4 * pin; }
}  // namespace strobe

/// Registers of a feature with absolute values, relative to its base.
namespace absolute {
/// IEEE 754 single precision.
inline constexpr std::uint32_t kMin = 0, kMax = 4, kValue = 8;
}  // namespace absolute

}  // namespace reg

/// Content of reg::kBasicFunctions.
struct BasicFunctions {
  bool advanced = false;
  /// 1394b with S800.
  bool beta = false;
  bool power_switch = false;
  [[nodiscard]] static constexpr BasicFunctions of(std::uint32_t q) noexcept {
    return {(q & bit(31)) != 0, (q & bit(23)) != 0, (q & bit(15)) != 0};
  }
};

struct Size {
  /// In px; x and y of a position.
  std::uint16_t width = 0, height = 0;
  [[nodiscard]] static constexpr Size of(std::uint32_t q) noexcept {
    return {static_cast<std::uint16_t>(q >> 16U), static_cast<std::uint16_t>(q & 0xFFFFU)};
  }
  [[nodiscard]] constexpr std::uint32_t quadlet() const noexcept {
    return static_cast<std::uint32_t>(width) << 16U | height;
  }
  [[nodiscard]] constexpr bool operator==(const Size&) const noexcept = default;
};

/// Isochronous channel and speed in both layouts of reg::kIsoChannel.
struct IsoChannel {
  /// At most 15 in the legacy layout.
  unsigned channel = 0;
  /// 0 (S100) to 3 (S800); above 2 only in the 1394b layout.
  unsigned speed = 2;
  /// True for the 1394b layout.
  bool beta = false;
  [[nodiscard]] static constexpr IsoChannel of(std::uint32_t q) noexcept {
    if ((q & bit(15)) != 0) return {field(q, 13, 8), field(q, 2, 0), true};
    return {field(q, 31, 28), field(q, 25, 24), false};
  }
  [[nodiscard]] constexpr std::uint32_t quadlet() const noexcept {
    return beta ? bit(15) | (channel & 63U) << 8U | (speed & 7U)
                : (channel & 15U) << 28U | (speed & 3U) << 24U;
  }
};

}  // namespace vergence::iidc
