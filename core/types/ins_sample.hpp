#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/types/time.hpp"

namespace vergence {

/// Position on WGS 84, with the height above the ellipsoid, not above sea level.
struct Geodetic {
  /// Latitude, north positive, [−90, 90].
  double latitude_deg = 0;
  /// Longitude, east positive, [−180, 360].
  double longitude_deg = 0;
  double height_m = 0;

  /// True if the position is finite and on or near the earth. Check every received position:
  /// swapped latitude and longitude near Brisbane, for example, are not one.
  [[nodiscard]] bool plausible() const noexcept {
    return std::abs(latitude_deg) <= 90.0 && longitude_deg >= -180.0 && longitude_deg <= 360.0 &&
           height_m > -1e3 && height_m < 1e5;
  }
};

enum class FixStatus : std::uint8_t {
  /// There is no position, or it is meaningless.
  none,
  /// The position is extrapolated by inertial sensors alone.
  dead_reckoning,
  /// The height is not measured.
  fix_2d,
  fix_3d,
};

/// Source of a heading without an attitude.
enum class HeadingSource : std::uint8_t {
  none,
  /// Direction of motion: the body's heading while it drives forwards without slip.
  course,
  /// Measured heading, from two antennas or a compass.
  heading,
};

/// One INS sample: position and attitude of its sensor body. A value: copied through rings.
///
/// Time    Stamp mapped to host time; `stamp_error` bounds the error of the mapping.
/// Frames  Body: forward, left, up. Attitude and velocity in the east-north-up axes at the point
///         itself.
/// Sigma   0 if the device provides none.
struct InsSample {
  /// Sample count of the device, unwrapped; gaps are lost samples.
  std::uint64_t number = 0;
  Stamp stamp{};
  Duration stamp_error{};
  FixStatus fix = FixStatus::none;
  bool attitude_valid = false;
  bool velocity_valid = false;

  Geodetic position{};
  /// Velocity, in m/s.
  std::array<double, 3> velocity_enu{};
  /// Attitude as Hamilton quaternion x y z w: v_enu = q ⊗ v_ins ⊗ q*.
  std::array<double, 4> q_enu_ins{0, 0, 0, 1};

  /// Heading of a receiver without an attitude, used if attitude_valid is false: yaw of the body
  /// about up, counter-clockwise from east, in rad.
  HeadingSource heading_source = HeadingSource::none;
  double yaw_enu = 0;

  /// Horizontal standard deviation per axis, in metres.
  double position_sigma = 0;
  /// Standard deviation of the height, in metres.
  double height_sigma = 0;
  /// Standard deviation of the velocity per axis, in m/s.
  double velocity_sigma = 0;
  /// Standard deviation of roll and of pitch, in rad.
  double tilt_sigma = 0;
  /// Standard deviation of the heading, in rad.
  double heading_sigma = 0;
};

/// Compass heading in degrees clockwise from north, [0, 360), from an ENU yaw (counter-clockwise
/// from east, rad).
[[nodiscard]] inline double compass_heading_deg(double yaw_enu) noexcept {
  const double degrees = std::fmod(90.0 - yaw_enu * (180.0 / std::numbers::pi), 360.0);
  return degrees < 0 ? degrees + 360.0 : degrees;
}

}  // namespace vergence
