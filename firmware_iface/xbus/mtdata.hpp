#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware_iface/xbus/values.hpp"

/// MTData (message 32) of the MTi-G and its siblings: fields in a fixed order, which of them and in
/// what format is said by the output mode and the output settings alone. Nothing in a message
/// repeats them: the length is the only check.
namespace vergence::xbus {

/// Bits of the output mode (message D0).
inline constexpr std::uint16_t kModeTemperature = 0x0001;
inline constexpr std::uint16_t kModeCalibrated = 0x0002;
inline constexpr std::uint16_t kModeOrientation = 0x0004;
inline constexpr std::uint16_t kModeAuxiliary = 0x0008;
inline constexpr std::uint16_t kModePosition = 0x0010;
inline constexpr std::uint16_t kModeVelocity = 0x0020;
inline constexpr std::uint16_t kModeStatus = 0x0800;
inline constexpr std::uint16_t kModeGnss = 0x1000;  // receiver's fix and air pressure
inline constexpr std::uint16_t kModeRaw = 0x4000;   // excludes all but kModeGnss

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
inline constexpr std::uint32_t kSettingsNed = 0x80000000;  // else x north, y west, z up
[[nodiscard]] constexpr std::uint32_t settings_format(NumberFormat format) noexcept {
  return static_cast<std::uint32_t>(format) << 8U;
}

/// Output mode and settings as the device has them.
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
  /// Bytes of a payload; nothing: a combination that has no meaning, or one that this code does not
  /// know.
  [[nodiscard]] std::optional<std::size_t> payload_size() const noexcept;
};

/// Quality of the receiver's fix, which the MTi-G repeats in every sample: a new one has
/// come when `age` is less than in the sample before.
struct LegacyFix {
  std::uint32_t horizontal_accuracy_mm = 0, vertical_accuracy_mm = 0, speed_accuracy_cm_s = 0;
  std::uint8_t age = 0;  // of the fix, samples
};

/// Fields of a message that an INS sample uses; absent: not in the layout. Units as
/// in Mtdata2.
struct Mtdata {
  std::optional<LegacyFix> fix;
  std::optional<std::array<double, 4>> quaternion;       // w x y z, sensor → frame
  std::optional<Three> euler_deg;                        // roll, pitch, yaw
  std::optional<std::array<double, 9>> rotation_matrix;  // row by row
  std::optional<std::array<double, 2>>
      latitude_longitude_deg;          // as float32 it steps by 0.2 m and more
  std::optional<double> altitude_m;    // above the ellipsoid
  std::optional<Three> velocity;       // m/s, in `frame`
  LocalFrame frame = LocalFrame::nwu;  // of orientation and velocity
  NumberFormat format = NumberFormat::float32;
  std::optional<std::uint8_t> status;
  std::optional<std::uint16_t> sample_counter;  // steps by one with every sample
  std::optional<Utc> utc;
};

/// Decodes a payload. False: it is not of this layout, or a number is none; *out untouched.
[[nodiscard]] bool decode_mtdata(std::span<const std::uint8_t> payload, const MtdataLayout& layout,
                                 Mtdata* out) noexcept;

/// Writes the layout's fields, absent ones and those that Mtdata has not as zeros. Returns the
/// bytes written; 0: the layout is unknown, or there is no room.
[[nodiscard]] std::size_t encode_mtdata(const Mtdata& data, const MtdataLayout& layout,
                                        std::span<std::uint8_t> out) noexcept;

}  // namespace vergence::xbus
