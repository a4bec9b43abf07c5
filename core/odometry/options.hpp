#pragma once
#include <cstdint>

namespace vergence {

/// Options of `odometry:`; the configuration's schema has a row for each.
struct OdometryOptions {
  /// Target number of tracked points per image, 50 … 1000.
  int features = 400;
  /// Features for the first transform of an uncalibrated rig: 0 corners, 1 SURF-64
  /// (docs/benchmarks.md).
  int init_features = 0;
  /// Number of pyramid levels, each half the size of the one below, 2 … 6.
  int pyramid_levels = 4;
  /// Half width of the search band around the epipolar line, 0.5 … 5.
  double band_px = 2.0;

  /// Standard deviation of one coordinate of a tracked corner on level 0, in px; also the minimum
  /// residual scale.
  double pixel_sigma = 0.15;
  /// Additional standard deviation in px, in quadrature, of a patch seen from one depth to the
  /// side, because its slope is unknown, 0 … 10.
  double parallax_sigma = 0.8;

  /// Number of keyframes in the adjusted window, 3 … 20.
  int window_keyframes = 10;
  /// Maximum prior sigma of the rotation between two cameras, 0 … 0.05; 0 keeps it fixed.
  double extrinsic_rotation_sigma_rad = 0.001;
  /// Maximum number of solver steps per new keyframe, 1 … 30.
  int window_steps = 5;
  /// Median angular displacement of the points since the last keyframe that triggers a new one, in
  /// rad, 0.005 … 0.3.
  double keyframe_parallax = 0.03;
  /// Share of the last keyframe's points that are still tracked below which a new one is made, 0.1
  /// … 1.
  double keyframe_tracked = 0.8;

  /// Minimum number of inliers of a pose; fewer make it `lost`, 6 … 200.
  int min_inliers = 20;
  /// Number of inliers below which a pose is `degraded: few_inliers`.
  int ok_inliers = 40;
  /// Maximum number of hypotheses per frame, 10 … 1000.
  int mlesac_hypotheses = 100;
  /// Seed of the sampling; equal seeds give equal poses.
  std::uint64_t seed = 1;
};

}  // namespace vergence
