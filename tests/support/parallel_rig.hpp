#pragma once
#include <algorithm>

#include "core/types/calibration.hpp"

namespace vergence::test {

/// A lens without distortion and with its principal point in the middle of the image.
[[nodiscard]] inline Intrinsics pinhole(int width, int height, double focal) {
  const double cx = 0.5 * (width - 1), cy = 0.5 * (height - 1);
  return {.width = width, .height = height, .fx = focal, .fy = focal, .cx = cx, .cy = cy};
}

/// Equal cameras whose axes are parallel; camera 1 is `baseline` m to the right of camera 0.
[[nodiscard]] inline RigCalibration parallel_rig(const Intrinsics& lens, double baseline,
                                                 int cameras = 2) {
  RigCalibration rig{.cameras = cameras, .baseline = baseline};
  std::fill_n(rig.intrinsics.begin(), cameras, lens);
  rig.T_camera_left[1].t = {-baseline, 0, 0};
  return rig;
}

}  // namespace vergence::test
