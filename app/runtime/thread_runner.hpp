#pragma once
#include <atomic>
#include <cstdint>
#include <thread>

#include "core/types/parallel.hpp"

namespace vergence::app {

/// A PairRunner with one worker thread: `here` on the caller, `there` on the worker, at the same
/// time.
///
/// Threads  run() from one thread. Both sides spin for kSpin before they sleep in the kernel: the
///          two halves of a front end end within microseconds of each other, and waking a sleeper
///          costs more than that.
/// Memory   None after construction; an estimator's worker is sealed (AllocationGuard), a reader's
///          is not: its tasks read files.
/// Errors   The constructor throws std::system_error when no thread can be had. The destructor
///          joins.
class ThreadRunner final : public PairRunner {
 public:
  enum class Worker : std::uint8_t { of_estimator, of_reader };

  explicit ThreadRunner(Worker worker = Worker::of_estimator);
  ~ThreadRunner() override;
  ThreadRunner(const ThreadRunner&) = delete;
  ThreadRunner& operator=(const ThreadRunner&) = delete;

  void run(TaskRef here, TaskRef there) noexcept override;

 private:
  void work(Worker worker) noexcept;

  const TaskRef* task_ = nullptr;        // of the run() in progress; published by asked_
  bool stop_ = false;                    // published by asked_
  std::atomic<std::uint32_t> asked_{0};  // calls of run(), and one for the end
  std::atomic<std::uint32_t> done_{0};   // calls the worker has answered
  std::thread worker_;
};

}  // namespace vergence::app
