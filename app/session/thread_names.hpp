#pragma once
#include <set>
#include <string>

#include "app/recorder/summary.hpp"

namespace vergence::app {

/// Collects the names of the threads while a drive goes on, so that one that made no allocation is
/// reported with its 0.
///
/// Threads  The caller's of a session.
class ThreadNames {
 public:
  /// Looks which threads there are.
  void look();
  /// ThreadAllocations' counts, beside the names that look() has seen.
  [[nodiscard]] ThreadAllocationFigures figures() const;

 private:
  std::set<std::string> ours_{};
};

/// `heap allocations while frames came: vergence-sync 3`, with the threads that are not 0; empty:
/// there are none.
[[nodiscard]] std::string allocations_sentence(const ThreadAllocationFigures& figures);

}  // namespace vergence::app
