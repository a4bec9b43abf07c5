#pragma once

namespace vergence {

/// Evidence from images of a difference between the rig and the calibration in use, or of a change
/// of the rig; zero if it is too large to be measured.
struct ChangeEvidence {
  /// Log-likelihood ratio of an event's statement against its opposite.
  double log_likelihood_ratio = 0;
  /// Displacement of the matches, rms: across their epipolar lines since the onset (knock, drift),
  /// or along them (disparity jump, depth error).
  double shift_px = 0;
  /// Rotation of camera k that moves its image by shift_px.
  double rotation_mrad = 0;
};

}  // namespace vergence
