#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

#include "core/types/parallel.hpp"

namespace vergence::app {

/// BackgroundRunner on its own thread. Both sides spin for 50 µs before they sleep in the kernel:
/// a task often ends, or follows, within microseconds, and waking a sleeper costs more.
///
/// Threads  One thread calls start(), busy() and wait(); the task runs on the other. The
///          calibration solver's thread has lower priority than the estimator's.
/// Memory   Does not allocate after construction. The thread is sealed (AllocationGuard), except a
///          reader's, whose tasks read files. start() and busy() never wait.
/// Errors   The constructor throws std::system_error if there is no thread. The destructor waits
///          for the task.
class BackgroundThread final : public BackgroundRunner {
 public:
  enum class Role : std::uint8_t { solver, front_end, reader };

  explicit BackgroundThread(Role role = Role::solver);
  ~BackgroundThread() override;

  void start(TaskRef task) noexcept override;
  [[nodiscard]] bool busy() noexcept override {
    return done_.load(std::memory_order_acquire) != asked_.load(std::memory_order_relaxed);
  }

  void wait() noexcept override;

 private:
  void work(Role role) noexcept;

  // Published by asked_.
  std::optional<TaskRef> task_{};
  // Published by asked_.
  bool stop_ = false;
  // Number of calls of start(), and one for the end.
  std::atomic<std::uint32_t> asked_{0};
  // Number of completed calls.
  std::atomic<std::uint32_t> done_{0};
  std::thread thread_;
};

/// PairRunner with a second thread, which waits as a BackgroundThread does. If that thread has not
/// started `there` when the caller is done with `here`, because its core is busy, the caller runs
/// both.
///
/// Threads  One caller; run() returns when both are done. The thread is sealed as a
///          BackgroundThread's is.
/// Memory   Does not allocate after construction.
/// Errors   The constructor throws std::system_error if there is no thread.
class ThreadRunner final : public PairRunner {
 public:
  explicit ThreadRunner(BackgroundThread::Role role = BackgroundThread::Role::front_end);
  ~ThreadRunner() override;

  void run(TaskRef here, TaskRef there) noexcept override;

 private:
  enum State : std::uint32_t { idle, offered, taken, ended };
  void work(BackgroundThread::Role role) noexcept;

  // Written while `idle`.
  std::optional<TaskRef> there_{};
  std::atomic<std::uint32_t> state_{idle};
  std::thread thread_;
};

/// Runner of the odometry for one thread, or for two if there are two or more.
[[nodiscard]] std::unique_ptr<PairRunner> make_runner(int threads);

/// The calibration solver's runner, with a note of the frames at which it was found idle: the one
/// thing by which time decides what the estimator does. With that note it answers in a replay as it
/// did in the drive.
///
/// Threads  As BackgroundRunner; begin_frame(), found_idle(): the same one. Memory: none.
class ReplayableSolverRunner final : public BackgroundRunner {
 public:
  explicit ReplayableSolverRunner(BackgroundRunner& solver) noexcept : solver_(solver) {}

  /// Call before Estimator::process(). `idle_then` is the recorded value in a replay: busy() then
  /// returns the same, and waits if the solver is slower now.
  void begin_frame(std::optional<bool> idle_then) noexcept {
    idle_then_ = idle_then;
    found_idle_ = false;
  }
  /// True if busy() found the task done since begin_frame().
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
