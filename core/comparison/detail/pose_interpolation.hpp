#pragma once
#include <span>

#include "core/math/se3.hpp"
#include "core/types/stamped_pose.hpp"

namespace vergence::detail {

/// Interpolates a trajectory by cubics through four poses, or linearly if there are not four.
/// Between poses 0.1 s apart, a car that brakes or turns deviates from the straight line by some
/// millimetres. Returns false if no two poses at most `max_gap` apart are around the time. Pure.
[[nodiscard]] bool pose_at(std::span<const StampedPose> trajectory, Stamp at, Duration max_gap,
                           Transform* out);

}  // namespace vergence::detail
