#include "core/estimator/detail/window_correction.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

// Half a metre a frame; a fit that is off by two centimetres.
WindowCorrection of(double moved_m) { return {moved_m, 0.5, 0.02}; }

TEST(WindowCorrection, correctionBeyondSigmaAndShareIsReported) {
  EXPECT_FALSE(of(0.0).motion_unreliable());
  // The correction is 1.2 sigmas and 4.98 % of the motion.
  EXPECT_FALSE(of(0.0249).motion_unreliable());
  EXPECT_TRUE(of(0.0251).motion_unreliable());
}

TEST(WindowCorrection, smallShareOfALongMotionIsIgnored) {
  const WindowCorrection highway{0.035, 2.4, 0.01};
  EXPECT_TRUE(highway.significant());
  EXPECT_FALSE(highway.motion_unreliable());
}

TEST(WindowCorrection, correctionWithinTheSigmaIsIgnored) {
  const WindowCorrection creeping{0.009, 0.03, 0.01};
  EXPECT_FALSE(creeping.significant());
  EXPECT_FALSE(creeping.motion_unreliable());
}

}  // namespace
}  // namespace vergence
