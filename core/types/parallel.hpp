#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <type_traits>

namespace vergence {

/// Reference to a callable without arguments, which must outlive it. No heap.
class TaskRef {
 public:
  template <class F>
  requires(!std::is_same_v<std::remove_cvref_t<F>, TaskRef>) explicit TaskRef(F& f) noexcept
      : object_(&f), call_([](void* o) noexcept { (*static_cast<F*>(o))(); }) {}
  void operator()() const noexcept { call_(object_); }

 private:
  void* object_;
  void (*call_)(void*) noexcept;
};

/// Runs two independent tasks and returns when both are done. The core owns no threads: the app
/// supplies one.
///
/// Threads  Called from the estimator's thread only. Tasks share nothing that they write but
///          atomics.
/// Errors   None; tasks are noexcept.
class PairRunner {
 public:
  virtual ~PairRunner() = default;
  virtual void run(TaskRef here, TaskRef there) noexcept = 0;
};

/// Runs both tasks on the caller's thread, with the same results.
class SequentialRunner final : public PairRunner {
 public:
  void run(TaskRef here, TaskRef there) noexcept override {
    here();
    there();
  }
};

/// Calls f(i) for i = 0 … n − 1, from both tasks of the runner. Each takes the next few indices in
/// turn, so that neither waits long for the other, even if its core is busy with something else.
/// Calls must not depend on each other.
template <class F>
void for_each_index(PairRunner& runner, std::size_t n, const F& f) noexcept {
  // Number of turns. A turn of a millisecond's stage (odometry_bench) then takes 30 µs, the shared
  // counter a thousandth of that.
  constexpr std::size_t kTurns = 32;
  const std::size_t turn = n / kTurns + 1;
  std::atomic<std::size_t> next{0};
  auto take = [&]() noexcept {
    for (std::size_t i = next.fetch_add(turn); i < n; i = next.fetch_add(turn))
      for (const std::size_t end = std::min(n, i + turn); i < end; ++i) f(i);
  };
  runner.run(TaskRef(take), TaskRef(take));
}

/// Runs one long task in the background: the calibration solver's thread, supplied by the app.
///
/// Threads  start(), busy() and wait() from one thread. The task runs on another, or within
///          start().
/// Errors   None; the task is noexcept.
class BackgroundRunner {
 public:
  virtual ~BackgroundRunner() = default;
  /// Precondition: !busy(). The callable's data must live until the task is done.
  virtual void start(TaskRef task) noexcept = 0;
  /// True until the last task is done; afterwards everything it wrote is visible to the caller.
  [[nodiscard]] virtual bool busy() noexcept = 0;
  /// Returns when the last task is done.
  virtual void wait() noexcept = 0;
};

/// Runs the task immediately on the caller's thread, for tests and for tools without a second
/// thread.
class ImmediateRunner final : public BackgroundRunner {
 public:
  void start(TaskRef task) noexcept override { task(); }
  [[nodiscard]] bool busy() noexcept override { return false; }
  void wait() noexcept override {}
};

}  // namespace vergence
