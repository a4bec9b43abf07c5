#pragma once
#include <cstdint>

#include "app/report/session.hpp"

namespace vergence::app::report {

/// What the distances of matches to their epipolar lines, by where they lie in the image, say of a
/// calibration.
enum class FitPattern : std::uint8_t {
  unknown,  // too few matches
  fine,     // no more than published calibrations leave
  turned,   // they grow towards the edges, equally for near and far points: a turn between the
            // cameras, or principal points
  lens,  // they grow towards the edges and differ between near and far points there: lens numbers
         // of another lens
};

/// Root mean squares over matches.
struct Fit {
  FitPattern pattern = FitPattern::unknown;
  double middle_px = 0,
         edge_px =
             0;  // of the cells' means, within and beyond half the image's diagonal from its centre
  double scatter_px = 0;  // within cells
};

/// Of camera 1 with the calibration in use at the end, or the one that the drive began with.
///
/// Limits (px) lie between what was measured on recorded drives. Edge, middle and scatter with true
/// or published calibrations: EuRoC MH_01 0.2, 0.2, 0.3; KITTI 00 0.6, 0.3, 0.3; KITTI raw 0039
/// 1.1, 0.5, 0.3. With lens numbers of another lens: KITTI raw without distortion 1.5, 1.0, 0.7;
/// EuRoC without distortion 1.1, 0.6, 0.4; KITTI 00 with distortion added 1.7, 0.5, 0.6.
[[nodiscard]] Fit fit_of(const Session& session, bool at_the_end);

}  // namespace vergence::app::report
