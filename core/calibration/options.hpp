#pragma once
#include <cstdint>

namespace vergence::calibration {

/// Which intrinsics are estimated together with the extrinsics.
enum class IntrinsicsEstimation : std::uint8_t {
  /// No intrinsics.
  fixed,
  /// The focal length of each additional camera, with its prior.
  focal,
  /// Also principal points of additional cameras and all distortion, with their priors.
  full,
};

/// Options of `calibration:`; the configuration's schema has a row for each field.
struct CalibrationOptions {
  /// Minimum number of moving rig frames of a solve, 5 … 150.
  int min_frames = 25;
  /// Maximum number of frames of a solve; older ones are dropped, 10 … 150.
  int max_frames = 150;
  /// Maximum number of observations of a solve, 10'000 … 1'000'000; beyond it frames are
  /// subsampled.
  int max_observations = 100'000;
  /// Frames after a snapshot within which its solution is adopted or rejected, 0 … 1000; a decision
  /// takes at least six frames.
  int adopt_after = 30;
  IntrinsicsEstimation intrinsics = IntrinsicsEstimation::full;
  /// Prior sigma of a focal length, 0.001 … 10.
  double focal_sigma_percent = 0.25;
  /// Assumed error of each coordinate of a fixed principal point, 0.01 … 50.
  double principal_point_sigma_px = 0.5;
  /// Prior sigma of an additional camera's principal point with `full`, 0.01 … 100.
  double lens_centre_sigma_px = 10;
  /// Prior sigma of the radial coefficients, and of k1 … k4 of equidistant lenses, 1e-5 … 1.
  double distortion_sigma = 0.01;
  /// Prior sigma of p1 and p2, 1e-6 … 0.1.
  double tangential_sigma = 0.003;
  /// Gate: maximum angle between t and the nominal one, 0.1 … 180.
  double max_direction_deg = 10;
  /// Gate: maximum rotation from the nominal one, 0.1 … 180. It does not apply to the first
  /// calibration from scratch.
  double max_rotation_deg = 10;
  /// Minimum number of points nearer than near_baselines in a solve, else `needs_near_structure`, 0
  /// … 1000.
  int min_near_points = 30;
  /// Maximum depth of a near point, in baselines, 5 … 500.
  double near_baselines = 40;
  /// Random walk of the extrinsics of an undisturbed rig; widens the prior with time, 0 … 100.
  double extrinsic_random_walk_mrad_per_sqrt_h = 0.3;
  /// Depth error at reference_depth_m up to which a calibration counts as verified, 0.1 … 50.
  double max_depth_error_percent = 2;
  /// Depth at which errors are evaluated, 0.5 … 500; see reference_depth_m() for short baselines.
  double reference_depth_m = 20;
  /// Predicted depth error at 20 m up to which the rating is `good`, 0.01 … 100.
  double good_depth_percent = 2;
  /// Predicted depth error at 20 m up to which the rating is `fair`, 0.01 … 100; a solution with a
  /// larger one at the reference depth is not adopted.
  double usable_depth_percent = 5;
};

}  // namespace vergence::calibration
