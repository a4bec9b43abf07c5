#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/types/time.hpp"

namespace vergence {

/// A place on WGS84. Height above the ellipsoid, not above the sea.
struct Geodetic {
  double latitude_deg = 0;   // north positive, [−90, 90]
  double longitude_deg = 0;  // east positive, [−180, 360]
  double height_m = 0;

  /// Finite and on the earth, from below the Dead Sea to above any aircraft. What a device sends is
  /// asked before it is used: swapped latitude and longitude near Brisbane is not a place.
  [[nodiscard]] bool plausible() const noexcept {
    return std::abs(latitude_deg) <= 90.0 && longitude_deg >= -180.0 && longitude_deg <= 360.0 &&
           height_m > -1e3 && height_m < 1e5;
  }
};

enum class FixStatus : std::uint8_t {
  none,            // no position, or one that means nothing
  dead_reckoning,  // carried on by inertia alone
  fix_2d,          // the height is not measured
  fix_3d,
};

/// Source of a heading without an attitude.
enum class HeadingSource : std::uint8_t {
  none,
  course,   // the direction of motion: the body's heading while it drives forwards without slip
  heading,  // measured: two antennas, a compass
};

/// One reading of the INS: where its sensor body is and how it lies. A value: copied through rings.
///
/// Time    Stamp mapped to host time; `stamp_error` bounds the error of the mapping.
/// Frames  Body: forward, left, up. Attitude and velocity in the east-north-up axes at the point
///         itself.
/// Sigma   0: the device gives none.
struct InsSample {
  std::uint64_t number = 0;  // the device's count, unwrapped; gaps are lost samples
  Stamp stamp{};
  Duration stamp_error{};
  FixStatus fix = FixStatus::none;
  bool attitude_valid = false;
  bool velocity_valid = false;
  Geodetic position{};
  std::array<double, 3> velocity_enu{};         // m/s
  std::array<double, 4> q_enu_ins{0, 0, 0, 1};  // Hamilton, x y z w: v_enu = q ⊗ v_ins ⊗ q*
  // A receiver has no attitude but may have a heading: yaw of the body about up,
  // counter-clockwise from east, rad. Means something where attitude_valid is false.
  HeadingSource heading_source = HeadingSource::none;
  double yaw_enu = 0;
  double position_sigma = 0;  // m, horizontal, each axis
  double height_sigma = 0;    // m
  double velocity_sigma = 0;  // m/s, each axis
  double tilt_sigma = 0;      // rad, roll and pitch each
  double heading_sigma = 0;   // rad
};

/// Heading as people read it: degrees clockwise from north, [0, 360), from an ENU yaw
/// (counter-clockwise from east, rad).
[[nodiscard]] inline double compass_heading_deg(double yaw_enu) noexcept {
  const double degrees = std::fmod(90.0 - yaw_enu * (180.0 / std::numbers::pi), 360.0);
  return degrees < 0 ? degrees + 360.0 : degrees;
}

}  // namespace vergence
