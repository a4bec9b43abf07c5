#pragma once
#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// Pose of a body at a time: p_world = T_world_body * p_body, in metres. The provider defines
/// `world` and `body`.
struct StampedPose {
  Stamp stamp{};
  Transform T_world_body{};
};

}  // namespace vergence
