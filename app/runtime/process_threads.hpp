#pragma once
#include <sys/types.h>

#include <string>
#include <vector>

namespace vergence::app {

/// A thread of this program, as the kernel lists it.
struct ProcessThread {
  pid_t id = 0;
  std::string name{};  // at most 15 bytes: what pthread_setname_np gave it, else the creator's

  /// One of ours that has its name; what a library starts is called otherwise.
  [[nodiscard]] bool ours() const noexcept { return name.starts_with("vergence"); }
};

/// All threads of this program into `threads`, by /proc/self/task; none where there is none such. A
/// thread that has just begun may still have its creator's name. Memory: of the vector alone, where
/// it grows.
void process_threads(std::vector<ProcessThread>* threads);

}  // namespace vergence::app
