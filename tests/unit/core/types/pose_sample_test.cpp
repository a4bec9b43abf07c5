#include "core/types/pose_sample.hpp"

#include <gtest/gtest.h>

#include "core/types/calibration.hpp"

namespace vergence {
namespace {

TEST(Intrinsics, equidistantIsDistortedWithoutCoefficients) {
  Intrinsics k;
  EXPECT_FALSE(k.has_distortion());
  k.distortion[4] = 1e-3;
  EXPECT_TRUE(k.has_distortion());
  k = {};
  k.kind = CameraModelKind::pinhole_equidistant;
  EXPECT_TRUE(k.has_distortion());
}

}  // namespace
}  // namespace vergence
