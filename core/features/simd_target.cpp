#include "core/features/simd_target.hpp"

#include <hwy/targets.h>

namespace vergence::features {

const char* simd_target() noexcept {
  const std::int64_t usable = hwy::SupportedTargets() & HWY_TARGETS;
  // The lowest bit is the best target.
  return hwy::TargetName(usable & -usable);
}

}  // namespace vergence::features
