#pragma once
#include <sched.h>
#include <sys/types.h>

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vergence::app {

/// Processors as taskset(1) has them, `0-1,3`. Nothing: another text, an empty one, or a number
/// beyond CPU_SETSIZE.
[[nodiscard]] std::optional<cpu_set_t> parse_cpu_list(std::string_view text) noexcept;

/// A thread of this program, as the kernel lists it.
struct ProcessThread {
  pid_t id = 0;
  /// At most 15 bytes: the name set by pthread_setname_np, else the creator's.
  std::string name{};

  /// True for a thread named by this program; those of libraries have other names.
  [[nodiscard]] bool own() const noexcept { return name.starts_with("vergence"); }
};

/// Lists all threads of this program in `threads` by /proc/self/task. A new thread may still have
/// its creator's name.
void process_threads(std::vector<ProcessThread>* threads);

/// Real-time role of a thread, by its name (docs/deployment.md has the table), the most urgent
/// first.
enum class ThreadRole : std::uint8_t {
  /// Cameras, trigger and synchroniser, which are short and must not be late.
  capture,
  /// Estimator and its worker.
  estimator,
  /// Samples of the INS.
  ins,
  /// Files, publishers and exposure control.
  background,
  /// Calibration solver, which gets the remaining time.
  solver,
  /// Unchanged: the caller's thread, the simulated world, threads of libraries.
  other
};

/// `realtime:` of the configuration: scheduling of a run's threads (docs/deployment.md).
struct RealtimeSettings {
  /// SCHED_FIFO priority of the most urgent threads; 0: none.
  int priority = 0;
  /// Processors of all roles except `other` and the solver, such as `0-1,3`; empty: any.
  std::string affinity{};
  std::string solver_affinity{};
  /// 1: call mlockall().
  int lock_memory = 0;
  /// Time budget per frame of a live run; 0: its frame interval.
  double frame_budget_ms = 0;
};

/// The system calls below, for tests to replace. Each returns 0 or errno.
class RealtimeSystem {
 public:
  enum class Locked : std::uint8_t { everything, present };

  virtual ~RealtimeSystem() = default;
  /// Sets SCHED_FIFO for that thread; the threads it starts are SCHED_OTHER again.
  [[nodiscard]] virtual int set_fifo(pid_t thread, int priority);
  [[nodiscard]] virtual int set_affinity(pid_t thread, const cpu_set_t& cpus);
  /// Locks what is mapped now, all of it resident, and where no limit stands in the way what is
  /// mapped later, as it is first used.
  [[nodiscard]] virtual int lock_memory(Locked* locked);
};

/// Applies the configured scheduling to the threads of a run. Threads are recognised by name, so
/// drivers and publishers do not depend on this. Called by one thread that is not of the run.
///
/// A refusal by the system gives a message with the fix, once per key; the run continues.
class RealtimeThreads {
 public:
  RealtimeThreads(const RealtimeSettings& settings, RealtimeSystem& system) noexcept
      : settings_(settings),
        affinity_(parse_cpu_list(settings.affinity)),
        solver_affinity_(parse_cpu_list(settings.solver_affinity)),
        system_(system) {}

  /// Locks memory, if asked for: when everything is set up, before the first frame.
  [[nodiscard]] std::vector<std::string> lock_memory();
  /// Priority and processors of the threads that were not there at the last call.
  [[nodiscard]] std::vector<std::string> apply(const std::vector<ProcessThread>& threads);

 private:
  void apply(const ProcessThread& thread, std::vector<std::string>* messages);
  void set_affinity(pid_t thread, const cpu_set_t& cpus, bool solver,
                    std::vector<std::string>* messages);

  const RealtimeSettings settings_;
  const std::optional<cpu_set_t> affinity_, solver_affinity_;
  RealtimeSystem& system_;
  std::map<pid_t, ThreadRole> done_{};
  bool priority_refused_ = false, affinity_refused_ = false, solver_affinity_refused_ = false;
};

}  // namespace vergence::app
