#pragma once
#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// Where a body was at a time. p_world = T_world_body * p_body, metres; what `world` and `body` are
/// states who hands it over.
struct StampedPose {
  Stamp stamp{};
  Transform T_world_body{};
};

}  // namespace vergence
