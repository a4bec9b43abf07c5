#pragma once
#include <time.h>

#include <cstdint>

#include "core/types/time.hpp"

namespace vergence {

[[nodiscard]] inline std::int64_t clock_ns(clockid_t clock) noexcept {
  timespec t{};
  (void)::clock_gettime(clock, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

/// The host's clock of all arrival stamps: CLOCK_MONOTONIC.
[[nodiscard]] inline HostStamp monotonic_now() noexcept {
  return HostStamp(clock_ns(CLOCK_MONOTONIC));
}

/// One instant on the host's real-time clock and on its monotonic clock.
struct HostMoment {
  Stamp day{};
  HostStamp host{};
};

/// Reads the real-time clock between two readings of the monotonic one. The thread may be preempted
/// in between, so the shortest of several trials is used.
template <class Day, class Host>
[[nodiscard]] HostMoment tightest_moment(Day day, Host host) {
  constexpr int kTrials = 5;
  HostMoment best;
  Duration least{};
  for (int i = 0; i < kTrials; ++i) {
    const HostStamp before = host();
    const Stamp now = day();
    const Duration took = host() - before;
    if (i > 0 && took >= least) continue;
    least = took;
    best = {now, before + took / 2};
  }
  return best;
}

[[nodiscard]] inline HostMoment moment_now() {
  return tightest_moment([] { return Stamp(clock_ns(CLOCK_REALTIME)); }, monotonic_now);
}

}  // namespace vergence
