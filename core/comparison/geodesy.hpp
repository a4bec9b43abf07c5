#pragma once
#include <GeographicLib/LocalCartesian.hpp>

#include "core/math/se3.hpp"
#include "core/types/ins_sample.hpp"

namespace vergence {

/// East-north-up frame at a fixed point of WGS 84: exact Cartesian axes, no projection.
///
///     const LocalTangentPlane plane(Geodetic{-27.5, 153.0, 40});
///     const Vec3 p_enu = plane.to_enu({-27.499, 153.001, 41});  // metres east, north, up
///     const Geodetic back = plane.to_geodetic(p_enu);
///
/// Threads  Const calls may run in parallel. Units: metres, degrees in Geodetic.
/// Errors   An implausible position gives meaningless numbers; check Geodetic::plausible() first.
class LocalTangentPlane {
 public:
  LocalTangentPlane() noexcept = default;
  explicit LocalTangentPlane(const Geodetic& origin);

  [[nodiscard]] const Geodetic& origin() const noexcept { return origin_; }
  [[nodiscard]] Vec3 to_enu(const Geodetic& place) const;
  [[nodiscard]] Geodetic to_geodetic(const Vec3& p_enu) const;
  /// Rotation R_enu_local with v_enu = R_enu_local * v_local, from the east-north-up axes at a
  /// position to those at the origin. 1 km away they differ by 1.6e-4 rad.
  [[nodiscard]] Mat3 rotation_from(const Geodetic& place) const noexcept;

 private:
  Geodetic origin_{};
  GeographicLib::LocalCartesian plane_{0, 0, 0};
};

}  // namespace vergence
