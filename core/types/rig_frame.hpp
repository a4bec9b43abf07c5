#pragma once
#include <array>
#include <cstdint>

#include "core/types/calibration.hpp"
#include "core/types/image.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// The images of one trigger pulse. `images[k].empty()`: camera k gave none.
///
/// Ownership  Views; whoever built the frame keeps the slots until Estimator::process() has
///            returned.
/// Time       One stamp for all: camera 0's mid-exposure. `spread`: the largest difference of the
///            others to it.
struct RigFrame {
  std::uint64_t number = 0;  // of the pulse or of the data set's line; gaps are gaps in time
  Stamp stamp{};
  Duration stamp_error{};  // bound of the stamp's error; 0 where the source gives none
  Duration spread{};
  int cameras = 0;
  std::array<ImageView, kMaxCameras> images{};
};

}  // namespace vergence
