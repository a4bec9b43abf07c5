#pragma once
#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "core/types/time.hpp"

namespace vergence::gige {

/// A thread that does something every `interval`, the first time after one of them.
///
/// Threads  start(), stop(): the owner. stopping(): any. Memory: start()'s.
/// Errors   start() throws where there is no thread. What `round` throws ends the program.
///
///     watch_.start("vergence-watch", Duration::milliseconds(100), [this] { look(); });
class PeriodicThread {
 public:
  ~PeriodicThread() { stop(); }

  /// Nothing happens where it runs already. `name`: at most 15 letters, and it stays.
  void start(const char* name, Duration interval, std::function<void()> round);
  /// Returns when the round in progress is over; at once where none runs.
  void stop() noexcept;
  /// For long rounds: somebody waits in stop().
  [[nodiscard]] bool stopping() const noexcept { return stopping_; }

 private:
  void work(const char* name, Duration interval, const std::function<void()>& round);

  std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace vergence::gige
