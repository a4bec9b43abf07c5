#pragma once
#include <set>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "app/runtime/progress.hpp"
#include "app/runtime/realtime.hpp"
#include "app/session/summary.hpp"

namespace vergence::app {

/// Applies the configured scheduling (`realtime`) to the threads of a run as they start, and
/// collects their names, so that threads without allocations are reported with 0. Used by the
/// session's caller. A refusal by the system is printed on *progress; the run continues.
class DriveThreads {
 public:
  explicit DriveThreads(const RealtimeSettings& settings);

  /// Locks memory if configured. Call when everything is set up, before the first frame.
  void lock_memory(Progress* progress);
  /// Call every 50 ms during the run.
  void poll(Progress* progress);
  /// Counts of ThreadAllocations, with the names that poll() has seen.
  [[nodiscard]] ThreadAllocationCounts allocations() const;

 private:
  RealtimeSystem system_;
  RealtimeThreads realtime_;
  int polls_ = 0;
  std::vector<ProcessThread> threads_;
  std::set<std::string> ours_{};
};

/// Message such as `runtime heap allocations: vergence-sync 3`; empty if there are none.
[[nodiscard]] std::string allocations_message(const ThreadAllocationCounts& allocations);

}  // namespace vergence::app
