#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware_iface/xbus/values.hpp"

/// MTData (message 32) of the MTi-G and related devices: fields in a fixed order. Only output mode
/// and output settings define which fields and formats are sent; a message can be checked only by
/// its length.
namespace vergence::xbus {

/// Bits of the output mode (message D0).
inline constexpr std::uint16_t kModeTemperature = 0x0001;
inline constexpr std::uint16_t kModeCalibrated = 0x0002;
inline constexpr std::uint16_t kModeOrientation = 0x0004;
inline constexpr std::uint16_t kModeAuxiliary = 0x0008;
inline constexpr std::uint16_t kModePosition = 0x0010;
inline constexpr std::uint16_t kModeVelocity = 0x0020;
inline constexpr std::uint16_t kModeStatus = 0x0800;
/// Receiver's fix and air pressure.
inline constexpr std::uint16_t kModeGnss = 0x1000;
/// Excludes all others but kModeGnss.
inline constexpr std::uint16_t kModeRaw = 0x4000;

/// Bits of the output settings (message D2).
inline constexpr std::uint32_t kSettingsCounter = 0x1;
inline constexpr std::uint32_t kSettingsUtc = 0x2;
inline constexpr std::uint32_t kSettingsQuaternion = 0x0;
inline constexpr std::uint32_t kSettingsEuler = 0x4;
inline constexpr std::uint32_t kSettingsMatrix = 0x8;
inline constexpr std::uint32_t kSettingsNoAcceleration = 0x10;
inline constexpr std::uint32_t kSettingsNoRateOfTurn = 0x20;
inline constexpr std::uint32_t kSettingsNoMagneticField = 0x40;
inline constexpr std::uint32_t kSettingsNoAnalogue1 = 0x400;
inline constexpr std::uint32_t kSettingsNoAnalogue2 = 0x800;
/// If unset, x is north, y west, z up.
inline constexpr std::uint32_t kSettingsNed = 0x80000000;
[[nodiscard]] constexpr std::uint32_t settings_format(NumberFormat format) noexcept {
  return static_cast<std::uint32_t>(format) << 8U;
}

/// Output mode and settings of a device.
struct MtdataLayout {
  std::uint16_t mode = 0;
  std::uint32_t settings = 0;

  constexpr bool operator==(const MtdataLayout&) const noexcept = default;
  [[nodiscard]] constexpr NumberFormat format() const noexcept {
    return static_cast<NumberFormat>((settings >> 8U) & 3U);
  }
  [[nodiscard]] constexpr LocalFrame frame() const noexcept {
    return (settings & kSettingsNed) != 0 ? LocalFrame::ned : LocalFrame::nwu;
  }
  /// Size of a payload in bytes; empty for an invalid or unsupported combination.
  [[nodiscard]] std::optional<std::size_t> payload_size() const noexcept;
};

/// Quality of the receiver's fix. The MTi-G repeats it in every sample; it is new if `age` has
/// decreased.
struct LegacyFix {
  std::uint32_t horizontal_accuracy_mm = 0, vertical_accuracy_mm = 0, speed_accuracy_cm_s = 0;
  /// Age of the fix in samples.
  std::uint8_t age = 0;
};

/// Fields of a message that an INS sample uses, absent if not in the layout. Units as in Mtdata2.
struct Mtdata {
  std::optional<LegacyFix> fix;
  /// Quaternion w x y z, sensor → frame.
  std::optional<std::array<double, 4>> quaternion;
  /// Roll, pitch, yaw.
  std::optional<Three> euler_deg;
  /// Row-major.
  std::optional<std::array<double, 9>> rotation_matrix;
  /// As float32 its resolution is 0.2 m or worse.
  std::optional<std::array<double, 2>> latitude_longitude_deg;
  /// Altitude above the ellipsoid.
  std::optional<double> altitude_m;
  /// In m/s, in `frame`.
  std::optional<Three> velocity;
  /// Frame of orientation and velocity.
  LocalFrame frame = LocalFrame::nwu;
  NumberFormat format = NumberFormat::float32;
  std::optional<std::uint8_t> status;
  /// Increases by one with every sample.
  std::optional<std::uint16_t> sample_counter;
  std::optional<Utc> utc;
};

/// Decodes a payload. Returns false, with *out unchanged, for another layout or an invalid number.
[[nodiscard]] bool decode_mtdata(std::span<const std::uint8_t> payload, const MtdataLayout& layout,
                                 Mtdata* out) noexcept;

/// Writes the layout's fields; absent and unsupported ones as zeros. Returns the number of bytes
/// written; 0 if the layout is unknown or there is no room.
[[nodiscard]] std::size_t encode_mtdata(const Mtdata& data, const MtdataLayout& layout,
                                        std::span<std::uint8_t> out) noexcept;

}  // namespace vergence::xbus
