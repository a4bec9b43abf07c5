#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "drivers/sync/rig_synchronizer.hpp"

/// Frames of a rig of two, one pulse every 40 ms, and the sets that come of them.
namespace vergence::testing {

inline constexpr Duration kRigInterval = Duration::milliseconds(40);
inline constexpr Duration kExposure = Duration::milliseconds(6);

struct RigSets {
  std::vector<SyncedSet> sets;

  void drain(RigSynchronizer* sync) {
    for (SyncedSet set; sync->next(&set);) sets.push_back(set);
  }
  SyncResult offer(RigSynchronizer* sync, const SyncFrame& f) {
    const SyncResult verdict = sync->offer(f);
    drain(sync);
    return verdict;
  }
  [[nodiscard]] std::size_t complete() const {
    return static_cast<std::size_t>(
        std::count_if(sets.begin(), sets.end(), [](const SyncedSet& s) { return s.complete; }));
  }
  /// Slots carry the pulse in every test here.
  void expect_pairs() const {
    for (const SyncedSet& s : sets) {
      if (s.present[0] && s.present[1]) {
        EXPECT_EQ(s.slots[0], s.slots[1]) << s.number;
      }
    }
  }
};

inline SyncFrame rig_frame(int camera, int pulse, std::uint64_t counter, HostStamp start,
                           DeviceStamp by_camera, Duration delay = Duration::milliseconds(30)) {
  SyncFrame f{.camera = camera,
              .slot = static_cast<FrameSlot>(pulse),
              .counter = counter,
              .middle = {start + kExposure / 2, Duration::microseconds(300)},
              .arrival = start + delay + Duration::microseconds(100 * camera),
              .exposure_start = by_camera,
              .exposure = kExposure};
  return f;
}

inline HostStamp rig_time(int pulse) { return HostStamp(77'000'000'000) + kRigInterval * pulse; }

inline SyncOptions rig_options(SyncMode mode) { return {.interval = kRigInterval, .mode = mode}; }

/// Sets from this many pulses that expose both cameras, stamped by their own clocks; to the
/// end.
template <class Stamp>
RigSets sets_of(RigSynchronizer* sync, int pulses, const Stamp& stamp_ns) {
  RigSets out;
  for (int n = 0; n < pulses; ++n)
    for (int k = 0; k < 2; ++k)
      (void)out.offer(sync, rig_frame(k, n, 0, rig_time(n), DeviceStamp(stamp_ns(n, k))));
  sync->finish();
  out.drain(sync);
  return out;
}

}  // namespace vergence::testing
