#pragma once
#include <cstdint>

namespace vergence {

/// Every number a user may change in `odometry:`; the configuration's schema (app/config) has a row
/// for each field.
struct OdometryOptions {
  int features = 400;         // tracked points per image aimed at, 50 … 1000
  int init_features = 0;      // features that give the first transform of an uncalibrated rig: 0
                              // corners, 1 SURF-64 (docs/benchmarks.md)
  int pyramid_levels = 4;     // 2 … 6; each halves the image
  double band_px = 2.0;       // half width of the band about the epipolar line across, 0.5 … 5
  double pixel_sigma = 0.15;  // px, of one coordinate of a tracked corner, level 0; also the floor
                              // of the residual scale
  double parallax_sigma = 0.8;  // px more, in quadrature, for a patch seen from one depth further
                                // to the side: its slope is unknown, 0 … 10
  double huber = 2.0;           // robust threshold in sigmas, 1 … 10
  int window_keyframes = 10;    // poses in the adjusted window, 3 … 20
  double extrinsic_rotation_sigma_rad =
      0.001;             // rad: what the turn between two cameras may be off by where
                         // their calibration does not say less, 0 … 0.05; 0: held as exact
  int window_steps = 5;  // solver steps a keyframe at most, 1 … 30
  double keyframe_parallax = 0.03;  // rad: median turn of the rays since the last keyframe that
                                    // makes a new one, 0.005 … 0.3
  double keyframe_tracked = 0.8;  // share of the last keyframe's points still tracked below which a
                                  // new one is made, 0.1 … 1
  int min_inliers = 20;           // points below which a pose is not used (`lost`), 6 … 200
  int ok_inliers = 40;            // points under which it is `degraded: few_inliers`
  int mlesac_hypotheses = 100;    // at most, a frame, 10 … 1000
  std::uint64_t seed = 1;         // of the sampling; same seed, same poses
};

}  // namespace vergence
