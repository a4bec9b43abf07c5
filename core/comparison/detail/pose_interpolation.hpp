#pragma once
#include <span>

#include "core/math/se3.hpp"
#include "core/types/stamped_pose.hpp"

namespace vergence::detail {

/// A trajectory at a time, by cubics through four poses where there are four, else straight:
/// between poses a tenth of a second apart a car that brakes or turns is some millimetres from the
/// straight line. False: no two poses at most `max_gap` apart are around it. Threads pure.
[[nodiscard]] bool pose_at(std::span<const StampedPose> trajectory, Stamp at, Duration max_gap,
                           Transform* out);

}  // namespace vergence::detail
