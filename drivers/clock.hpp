#pragma once
#include <time.h>

#include "core/types/time.hpp"

namespace vergence {

/// The host's clock that arrivals are told in.
[[nodiscard]] inline HostStamp monotonic_now() noexcept {
  timespec t{};
  (void)::clock_gettime(CLOCK_MONOTONIC, &t);
  return HostStamp(static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec);
}

}  // namespace vergence
