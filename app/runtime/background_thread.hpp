#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

#include "core/types/parallel.hpp"

namespace vergence::app {

/// A BackgroundRunner on a thread of its own, made with it. Both sides spin for 20 µs before they
/// sleep in the kernel: the halves of a front end end within microseconds of each other, and waking
/// a sleeper costs more than that.
///
/// Threads  start(), busy(), wait(): one thread. The task runs on the other; the calibration
///          solver's yields to the estimator's where a core is short.
/// Memory   None after construction; the thread is sealed (AllocationGuard), a reader's is not: its
///          tasks read files. No lock: start() and busy() never wait.
/// Errors   The constructor throws std::system_error when no thread can be had. The destructor
///          waits for the task.
class BackgroundThread final : public BackgroundRunner {
 public:
  enum class Role : std::uint8_t { solver, front_end, reader };

  explicit BackgroundThread(Role role = Role::solver);
  ~BackgroundThread() override;
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

  void start(TaskRef task) noexcept override;
  [[nodiscard]] bool busy() noexcept override;
  void wait() noexcept override;

 private:
  void work(Role role) noexcept;

  std::optional<TaskRef> task_{};        // published by asked_
  bool stop_ = false;                    // published by asked_
  std::atomic<std::uint32_t> asked_{0};  // calls of start(), and one for the end
  std::atomic<std::uint32_t> done_{0};   // calls the thread has answered
  std::thread thread_;
};

/// A PairRunner with one such thread: `here` on the caller, `there` on the thread, at the same
/// time.
class ThreadRunner final : public PairRunner {
 public:
  explicit ThreadRunner(BackgroundThread::Role role = BackgroundThread::Role::front_end)
      : thread_(role) {}

  void run(TaskRef here, TaskRef there) noexcept override {
    thread_.start(there);
    here();
    thread_.wait();
  }

 private:
  BackgroundThread thread_;
};

/// One worker beside the estimator with two threads or more.
[[nodiscard]] inline std::unique_ptr<PairRunner> make_runner(int threads) {
  if (threads >= 2) return std::make_unique<ThreadRunner>();
  return std::make_unique<SequentialRunner>();
}

/// The calibration solver's runner, with a note of the frames at which it was found idle: the one
/// thing by which time decides what the estimator does. With that note it answers in a replay as it
/// did in the drive.
///
/// Threads  As BackgroundRunner; begin_frame(), found_idle(): the same one. Memory: none.
class ReplayableSolverRunner final : public BackgroundRunner {
 public:
  explicit ReplayableSolverRunner(BackgroundRunner& solver) noexcept : solver_(solver) {}

  /// Before Estimator::process(). `idle_then`: of a replay, what was found at this frame of the
  /// drive: busy() says the same, waiting where the solver is slower now.
  void begin_frame(std::optional<bool> idle_then) noexcept {
    idle_then_ = idle_then;
    found_idle_ = false;
  }
  /// busy() was asked since begin_frame(), and the task was done.
  [[nodiscard]] bool found_idle() const noexcept { return found_idle_; }

  void start(TaskRef task) noexcept override { solver_.start(task); }
  [[nodiscard]] bool busy() noexcept override {
    if (idle_then_ && !*idle_then_) return true;
    if (idle_then_) solver_.wait();
    const bool busy = solver_.busy();
    found_idle_ = found_idle_ || !busy;
    return busy;
  }
  void wait() noexcept override { solver_.wait(); }

 private:
  BackgroundRunner& solver_;
  std::optional<bool> idle_then_{};
  bool found_idle_ = false;
};

}  // namespace vergence::app
