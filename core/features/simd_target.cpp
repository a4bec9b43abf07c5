#include "core/features/simd_target.hpp"

#include <hwy/targets.h>

namespace vergence::features {

const char* simd_target() noexcept {
  const std::int64_t usable = hwy::SupportedTargets() & HWY_TARGETS;
  return hwy::TargetName(usable & -usable);  // the lowest bit is the best one
}

}  // namespace vergence::features
