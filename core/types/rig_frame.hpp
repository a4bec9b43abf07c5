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
  /// There is no evidence: a recording, or images paired by count or arrival.
  assumed,
  /// Pulse numbers or stamps of one clock exclude any other pairing.
  verified,
  /// The evidence is contradictory; only the images themselves are certain.
  contradicted,
};

/// Images of one trigger pulse. `images[k]` is empty if camera k gave none.
///
/// Ownership  Views; the frame's producer keeps the slots until Estimator::process() has
///            returned.
/// Time       One stamp for all: mid-exposure of camera 0. `spread` is the maximum deviation of the
///            others.
struct RigFrame {
  /// Number of the pulse or of the data set's line; gaps are gaps in time.
  std::uint64_t number = 0;
  Stamp stamp{};
  /// Bound of the stamp's error; 0 if unknown.
  Duration stamp_error{};
  Duration spread{};
  Pairing pairing = Pairing::assumed;
  int cameras = 0;
  /// Workload of a replayed frame, which is repeated exactly.
  std::optional<FrameWorkload> effort{};
  std::array<ImageView, kMaxCameras> images{};
};

}  // namespace vergence
