#pragma once
#include <cstdint>

namespace vergence::calibration {

/// Every number a user may change in `calibration:` (METHOD §3); the configuration's schema has a row for each field.
struct CalibrationOptions {
  int min_frames = 25;                    // moving rig frames before a solve is tried, 5 … 150
  int max_frames = 150;                   // of which the newest so many are kept and solved, 10 … 150
  double rotation_sigma_mrad = 0.15;      // enough: noise-only sigma of each axis, 0.001 … 10
  double translation_sigma_mm = 4.0;      // enough: of t_y and t_z, for a baseline of 0.75 m, in proportion to it, 0.01 … 1000
  int adopt_after = 30;                   // frames from a snapshot to its adoption in replay and --fast, 0 … 1000
  int estimate_focal_lengths = 1;         // 1: of each further camera, with its prior; 0: held
  int refine_intrinsics = 0;              // 1: focal lengths and principal points of all cameras, with their priors
  double focal_sigma_percent = 0.1;       // prior sigma of a focal length, 0.001 … 10
  double principal_point_sigma_px = 0.5;  // prior sigma of a principal point's coordinate, 0.01 … 50
  double max_direction_deg = 10;          // gate: direction of t from the nominal one, 0.1 … 180
  double max_rotation_deg = 10;           // gate: rotation from the nominal one; from scratch only the sign of t_x is asked, 0.1 … 180
  double needs_motion_m = 1;              // travelled in the window, and three baselines, else `needs_motion`, 0.01 … 1000
  int needs_near_points = 30;             // points nearer than near_baselines, else `needs_near_structure`, 0 … 1000
  double near_baselines = 40;             // 5 … 500
  double good_depth_percent = 2;          // health word: predicted depth error at 20 m up to which it is `good`, 0.01 … 100
  double usable_depth_percent = 5;        // up to which it `can be improved`; beyond: `recalibrate`, 0.01 … 100
};

}  // namespace vergence::calibration
