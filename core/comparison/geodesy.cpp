#include "core/comparison/geodesy.hpp"

namespace vergence {
namespace {

/// East, north and up at a position as columns in earth-centred axes. Up is the ellipsoid's normal.
Mat3 earth_axes(const Geodetic& place) noexcept {
  const double phi = place.latitude_deg * (std::numbers::pi / 180.0),
               lambda = place.longitude_deg * (std::numbers::pi / 180.0);
  const double sp = std::sin(phi), cp = std::cos(phi), sl = std::sin(lambda), cl = std::cos(lambda);
  Mat3 R;
  R << -sl, -sp * cl, cp * cl, cl, -sp * sl, cp * sl, 0, cp, sp;
  return R;
}

}  // namespace

LocalTangentPlane::LocalTangentPlane(const Geodetic& origin)
    : origin_(origin), plane_(origin.latitude_deg, origin.longitude_deg, origin.height_m) {}

Vec3 LocalTangentPlane::to_enu(const Geodetic& place) const {
  double e = 0, n = 0, u = 0;
  plane_.Forward(place.latitude_deg, place.longitude_deg, place.height_m, e, n, u);
  return {e, n, u};
}

Geodetic LocalTangentPlane::to_geodetic(const Vec3& p_enu) const {
  Geodetic place;
  plane_.Reverse(p_enu.x(), p_enu.y(), p_enu.z(), place.latitude_deg, place.longitude_deg,
                 place.height_m);
  return place;
}

Mat3 LocalTangentPlane::rotation_from(const Geodetic& place) const noexcept {
  return earth_axes(origin_).transpose() * earth_axes(place);
}

}  // namespace vergence
