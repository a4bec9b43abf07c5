#pragma once

namespace vergence {

/// What the images show of a difference between the rig and the calibration in use, or of a change
/// of the rig; zero where it is too large to be measured.
struct ChangeEvidence {
  double log_likelihood_ratio = 0;  // of what an event states against its contrary
  double shift_px = 0;       // of the matches across their epipolar lines (knock, drift), rms since
                             // the onset, or along them (disparity jump, depth error)
  double rotation_mrad = 0;  // of camera k that moves its image by as much
};

}  // namespace vergence
