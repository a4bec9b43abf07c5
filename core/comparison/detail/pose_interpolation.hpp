#pragma once
#include <span>

#include "core/math/se3.hpp"
#include "core/types/stamped_pose.hpp"

namespace vergence::detail {

/// Interpolates a trajectory by cubics through four poses, or linearly if there are not four:
/// between poses 0.1 s apart, a braking or turning car deviates from a straight line by
/// millimetres. Returns false if no two poses at most `max_gap` apart enclose the time. Pure.
[[nodiscard]] bool pose_at(std::span<const StampedPose> trajectory, Stamp at, Duration max_gap,
                           Transform* out);

}  // namespace vergence::detail
