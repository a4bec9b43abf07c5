#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "core/types/calibration.hpp"
#include "core/types/frame_workload.hpp"
#include "core/types/image.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// Evidence that the images of a rig frame were exposed together.
enum class Pairing : std::uint8_t {
  assumed,       // nothing proves it: a recording, or images paired by count or by arrival
  verified,      // pulse numbers or stamps of one clock leave no other
  contradicted,  // what should prove it contradicts itself: each image is one, nothing more is sure
};

/// The images of one trigger pulse. `images[k].empty()`: camera k gave none.
///
/// Ownership  Views; the frame's producer keeps the slots until Estimator::process() has
///            returned.
/// Time       One stamp for all: camera 0's mid-exposure. `spread`: the largest difference of the
///            others to it.
struct RigFrame {
  std::uint64_t number = 0;  // of the pulse or of the data set's line; gaps are gaps in time
  Stamp stamp{};
  Duration stamp_error{};  // bound of the stamp's error; 0 where the source gives none
  Duration spread{};
  Pairing pairing = Pairing::assumed;
  int cameras = 0;
  std::optional<FrameWorkload> effort{};  // of a recorded drive: no more and no less is done again
  std::array<ImageView, kMaxCameras> images{};
};

}  // namespace vergence
