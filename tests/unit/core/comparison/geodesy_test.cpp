#include "core/comparison/geodesy.hpp"

#include <gtest/gtest.h>

#include <array>

namespace vergence {
namespace {

struct KnownPoint {
  Geodetic origin, point;
  // ENU coordinates in m, with six decimals.
  Vec3 enu;
};

// Both hemispheres, computed with GeographicLib's CartConvert and checked through earth-centred
// coordinates.
const std::array kKnown = {
    KnownPoint{{49.011212804408, 8.4228850417969, 112.83492279053},
               {49.012, 8.4235, 113.5},
               {44.987583, 87.545734, 0.664317}},
    KnownPoint{
        {-27.4975, 153.0137, 40}, {-27.4980, 153.0142, 41.5}, {49.407283, -55.406162, 1.499567}},
    KnownPoint{{-27.4975, 153.0137, 40},
               {-27.5100, 152.9990, 38},
               {-1452.415758, -1385.238005, -2.316367}},
};

TEST(LocalTangentPlane, knownPointsMatchToAMicrometre) {
  for (const KnownPoint& k : kKnown) {
    const LocalTangentPlane plane(k.origin);
    EXPECT_LT((plane.to_enu(k.point) - k.enu).cwiseAbs().maxCoeff(), 1e-6);
    const Geodetic back = plane.to_geodetic(plane.to_enu(k.point));
    EXPECT_NEAR(back.latitude_deg, k.point.latitude_deg, 1e-12);
    EXPECT_NEAR(back.longitude_deg, k.point.longitude_deg, 1e-12);
    EXPECT_NEAR(back.height_m, k.point.height_m, 1e-7);
  }
}

TEST(LocalTangentPlane, rotationFromIsTheCoordinateDerivative) {
  for (const KnownPoint& k : kKnown) {
    const LocalTangentPlane plane(k.origin);
    const Mat3 R = plane.rotation_from(k.point);
    EXPECT_LT((R * R.transpose() - Mat3::Identity()).norm(), 1e-14);
    // One metre along the local axes at the point, laid off by a plane that stands there.
    const LocalTangentPlane there(k.point);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 moved = plane.to_enu(there.to_geodetic(Vec3::Unit(axis)));
      EXPECT_LT((moved - plane.to_enu(k.point) - R.col(axis)).norm(), 1e-7) << axis;
    }
  }
}

TEST(CompassHeading, headingIsClockwiseFromNorth) {
  constexpr double kPi = std::numbers::pi;
  // The headings are east, north, south and west.
  EXPECT_NEAR(compass_heading_deg(0), 90, 1e-12);
  EXPECT_NEAR(compass_heading_deg(kPi / 2), 0, 1e-12);
  EXPECT_NEAR(compass_heading_deg(-kPi / 2), 180, 1e-12);
  EXPECT_NEAR(compass_heading_deg(kPi), 270, 1e-12);
  EXPECT_NEAR(compass_heading_deg(5 * kPi / 2 + 0.1), 360 - 0.1 * 180 / kPi, 1e-9);
}

}  // namespace
}  // namespace vergence
