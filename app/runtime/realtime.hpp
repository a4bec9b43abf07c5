#pragma once
#include <sys/types.h>

#include <map>
#include <string>
#include <string_view>
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
/// thread that has just begun may still have its creator's name.
void process_threads(std::vector<ProcessThread>* threads);

/// Real-time role of a thread, by its name (docs/deployment.md has the table).
enum class ThreadRole : std::uint8_t {
  capture,     // cameras, trigger, synchroniser: short, and never late
  estimator,   // and its worker
  ins,         // readings of the INS
  background,  // files, publishers, exposure control
  solver,      // the calibration solver: has what the others leave
  other        // the caller's thread, the mock's world, threads of libraries: left as they are
};

[[nodiscard]] ThreadRole thread_role(std::string_view name) noexcept;

/// SCHED_FIFO priority of a role where the most urgent has `top`; 0: SCHED_OTHER.
[[nodiscard]] int role_priority(ThreadRole role, int top) noexcept;

/// The system calls below, for tests to replace. Each returns 0 or errno.
class RealtimeSystem {
 public:
  enum class Locked : std::uint8_t { everything, present };

  virtual ~RealtimeSystem() = default;
  /// SCHED_FIFO for that thread; what it starts is SCHED_OTHER again.
  [[nodiscard]] virtual int set_fifo(pid_t thread, int priority);
  /// Locks what is mapped now, all of it resident, and where no limit stands in the way what is
  /// mapped later, as it is first used.
  [[nodiscard]] virtual int lock_memory(Locked* locked);
};

/// Gives the threads of a drive the scheduling that the configuration asks for. A thread is
/// recognised by its name, so drivers and publishers need not know of it.
///
/// Threads  One, which is none of the drive's.
/// Errors   A refusal by the system is a message, once for each key, with what allows it; the
///          drive goes on.
class RealtimeThreads {
 public:
  /// `priority`: of ThreadRole::capture; 0: no thread gets one.
  RealtimeThreads(int priority, RealtimeSystem& system) noexcept
      : priority_(priority), system_(system) {}

  /// Locks memory: call it when everything is set up, before the first frame.
  [[nodiscard]] std::vector<std::string> lock_memory();
  /// Sets the priority of the threads that were not there at the last call.
  [[nodiscard]] std::vector<std::string> apply(const std::vector<ProcessThread>& threads);

 private:
  const int priority_;
  RealtimeSystem& system_;
  std::map<pid_t, ThreadRole> done_{};
  bool refused_ = false;
};

}  // namespace vergence::app
