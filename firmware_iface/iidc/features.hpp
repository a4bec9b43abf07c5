#pragma once
#include <cstdint>

#include "firmware_iface/iidc/registers.hpp"

/// Features such as shutter and gain, the trigger and the strobe outputs.
namespace vergence::iidc {

/// Features set by the driver; the number is their index in every table of features.
enum class Feature : std::uint8_t {
  auto_exposure = 1,
  gamma = 6,
  /// Absolute value in s.
  shutter = 7,
  /// Absolute value in dB.
  gain = 8,
  /// Absolute value in s.
  trigger_delay = 13,
  /// Absolute value in Hz.
  frame_rate = 15,
};

namespace reg {
[[nodiscard]] constexpr std::uint32_t feature_inquiry(Feature f) noexcept {
  return 0x500 + 4 * static_cast<std::uint32_t>(f);
}
[[nodiscard]] constexpr std::uint32_t feature_absolute_base(Feature f) noexcept {
  return 0x700 + 4 * static_cast<std::uint32_t>(f);
}
[[nodiscard]] constexpr std::uint32_t feature_value(Feature f) noexcept {
  return 0x800 + 4 * static_cast<std::uint32_t>(f);
}
}  // namespace reg

struct FeatureInquiry {
  bool present = false, absolute = false, on_off = false, automatic = false;
  [[nodiscard]] static constexpr FeatureInquiry of(std::uint32_t q) noexcept {
    return {(q & bit(31)) != 0, (q & bit(30)) != 0, (q & bit(26)) != 0, (q & bit(25)) != 0};
  }
};

struct FeatureValue {
  bool present = false;
  /// True if the absolute value is in effect.
  bool absolute = false;
  bool one_push = false;
  bool on = false;
  bool automatic = false;
  /// 12 bits.
  std::uint32_t value = 0;
  [[nodiscard]] static constexpr FeatureValue of(std::uint32_t q) noexcept {
    return {(q & bit(31)) != 0, (q & bit(30)) != 0, (q & bit(26)) != 0,
            (q & bit(25)) != 0, (q & bit(24)) != 0, field(q, 11, 0)};
  }
  [[nodiscard]] constexpr std::uint32_t quadlet() const noexcept {
    return (present ? bit(31) : 0) | (absolute ? bit(30) : 0) | (one_push ? bit(26) : 0) |
           (on ? bit(25) : 0) | (automatic ? bit(24) : 0) | (value & 0xFFFU);
  }
};

inline constexpr unsigned kTriggerSourceSoftware = 7;

/// Content of reg::kTriggerInquiry.
struct TriggerInquiry {
  bool present = false, polarity = false, software = false;
  /// Bit n stands for input n, 0 to 3.
  std::uint8_t sources = 0;
  /// Bit n stands for mode n; 0 to 5, 14 and 15 exist.
  std::uint16_t modes = 0;
  [[nodiscard]] static constexpr TriggerInquiry of(std::uint32_t q) noexcept {
    TriggerInquiry t{(q & bit(31)) != 0, (q & bit(25)) != 0, (q & bit(16)) != 0, 0, 0};
    for (unsigned n = 0; n < 4; ++n)
      if ((q & bit(23 - n)) != 0) t.sources = static_cast<std::uint8_t>(t.sources | 1U << n);
    for (unsigned n = 0; n < 6; ++n)
      if ((q & bit(15 - n)) != 0) t.modes = static_cast<std::uint16_t>(t.modes | 1U << n);
    if ((q & bit(1)) != 0) t.modes = static_cast<std::uint16_t>(t.modes | 1U << 14U);
    if ((q & bit(0)) != 0) t.modes = static_cast<std::uint16_t>(t.modes | 1U << 15U);
    return t;
  }
  [[nodiscard]] constexpr bool has_mode(unsigned mode) const noexcept {
    return mode < 16 && (modes >> mode & 1U) != 0;
  }
  [[nodiscard]] constexpr bool has_source(unsigned source) const noexcept {
    return source == kTriggerSourceSoftware ? software
                                            : source < 4 && (sources >> source & 1U) != 0;
  }
};

/// Content of reg::kTriggerMode.
struct TriggerMode {
  bool on = false;
  /// Active high.
  bool rising = true;
  /// Input 0 to 3, or kTriggerSourceSoftware.
  unsigned source = 0;
  /// 0: one frame per edge; 14: the same, exposing during readout.
  unsigned mode = 0;
  [[nodiscard]] constexpr std::uint32_t quadlet() const noexcept {
    return bit(31) | (on ? bit(25) : 0) | (rising ? bit(24) : 0) | (source & 7U) << 21U |
           (mode & 15U) << 16U;
  }
};

/// Settings of a strobe output (reg::strobe::control). Times are in 1/1024 ms.
struct StrobeControl {
  bool on = false;
  /// Active level.
  bool high = true;
  /// 12 bits, from the start of the exposure.
  std::uint32_t delay = 0;
  /// 12 bits; 0: as long as the exposure.
  std::uint32_t duration = 0;
  [[nodiscard]] constexpr std::uint32_t quadlet() const noexcept {
    return bit(31) | (on ? bit(25) : 0) | (high ? bit(24) : 0) | (delay & 0xFFFU) << 12U |
           (duration & 0xFFFU);
  }
};

}  // namespace vergence::iidc
