#pragma once
#include <cstdint>

namespace vergence::calibration {

/// Which intrinsics are estimated together with the extrinsics.
enum class IntrinsicsEstimation : std::uint8_t {
  fixed,  // none
  focal,  // the focal length of each additional camera, with its prior
  full,   // also principal points and distortion, where the data show that the initial ones are off
};

/// Every number a user may change in `calibration:` (METHOD §3); the configuration's schema has a
/// row for each field.
struct CalibrationOptions {
  int min_frames = 25;   // moving rig frames before a solve is tried, 5 … 150
  int max_frames = 150;  // of which the newest so many are kept and solved, 10 … 150
  int max_observations =
      100'000;  // of one solve: beyond it frames are taken at wider steps, 10'000 … 1'000'000
  int adopt_after = 30;  // frames after a snapshot at which its solution is decided about at the
                         // latest, 0 … 1000
  IntrinsicsEstimation intrinsics = IntrinsicsEstimation::full;
  double focal_sigma_percent = 0.25;  // prior sigma of a focal length, 0.001 … 10
  double principal_point_sigma_px =
      0.5;  // what a principal point that is held may be off by, a coordinate, 0.01 … 50
  double lens_centre_sigma_px =
      10;  // prior sigma of a further camera's principal point with the lenses free, 0.01 … 100
  double distortion_sigma =
      0.01;  // the same of radial coefficients, and of k1 … k4 of equidistant lenses, 1e-5 … 1
  double tangential_sigma = 0.003;  // the same of p1, p2, 1e-6 … 0.1
  double max_direction_deg = 10;    // gate: direction of t from the nominal one, 0.1 … 180
  double max_rotation_deg = 10;     // gate: rotation from the nominal one, 0.1 … 180; the first
                                    // calibration of a drive from scratch is not asked for it
  int min_near_points =
      30;  // points nearer than near_baselines, else `needs_near_structure`, 0 … 1000
  double near_baselines = 40;  // 5 … 500
  double extrinsic_random_walk_mrad_per_sqrt_h =
      0.3;  // random walk of a rig that nobody touches, in an hour: what is known
            // of it grows old, 0 … 100
  double max_depth_error_percent = 2;  // depth error up to which a calibration counts as confirmed,
                                       // at reference_depth_m, 0.1 … 50
  double reference_depth_m =
      20;  // or nearer, where a single match is no better than that: short baselines, 0.5 … 500
  double good_depth_percent =
      2;  // health word: predicted depth error at 20 m up to which it is `good`, 0.01 … 100
  double usable_depth_percent =
      5;  // up to which it `can be improved`; beyond: `recalibrate`, 0.01 … 100
};

}  // namespace vergence::calibration
