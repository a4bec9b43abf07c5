#pragma once
#include <set>
#include <string>
#include <vector>

#include "app/runtime/progress.hpp"
#include "app/runtime/realtime.hpp"
#include "app/session/summary.hpp"

namespace vergence::app {

/// The threads of a drive as they come: gives them the scheduling that `realtime:` asks for, and
/// collects their names, so that one that made no allocation is reported with its 0.
///
/// Threads  The caller's of a session.
/// Errors   What the system refuses is said on *progress; the drive goes on.
class DriveThreads {
 public:
  explicit DriveThreads(const RealtimeSettings& settings);

  /// Locks memory, if asked for: everything is set up, and no frame has come.
  void lock_memory(Progress* progress);
  /// Called every 50 ms while frames come.
  void poll(Progress* progress);
  /// ThreadAllocations' counts, beside the names that poll() has seen.
  [[nodiscard]] ThreadAllocationCounts allocations() const;

 private:
  RealtimeSystem system_;
  RealtimeThreads realtime_;
  int polls_ = 0;
  std::vector<ProcessThread> threads_;
  std::set<std::string> own_{};
};

/// `runtime heap allocations: vergence-sync 3`, with the threads that are not 0; empty:
/// there are none.
[[nodiscard]] std::string allocations_message(const ThreadAllocationCounts& allocations);

}  // namespace vergence::app
