#pragma once
#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>

#include "core/types/parallel.hpp"

namespace vergence::app {

/// A BackgroundRunner on a thread of its own, made with it: the calibration solver's, beside the
/// estimator's.
///
/// Threads  start(), busy(), wait(): one thread. The task runs on the other, which yields to the
///          estimator's where a core is short.
/// Memory   None after construction; the thread is sealed (AllocationGuard). No lock: start() and
///          busy() never wait.
/// Errors   The constructor throws std::system_error when no thread can be had. The destructor
///          waits for the task.
class BackgroundThread final : public BackgroundRunner {
 public:
  BackgroundThread();
  ~BackgroundThread() override;
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

  void start(TaskRef task) noexcept override;
  [[nodiscard]] bool busy() noexcept override;
  void wait() noexcept override;

 private:
  void work() noexcept;

  std::optional<TaskRef> task_{};        // published by asked_
  bool stop_ = false;                    // published by asked_
  std::atomic<std::uint32_t> asked_{0};  // calls of start(), and one for the end
  std::atomic<std::uint32_t> done_{0};   // calls the thread has answered
  std::thread thread_;
};

}  // namespace vergence::app
