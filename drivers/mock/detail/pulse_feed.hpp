#pragma once
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <queue>

#include "core/types/time.hpp"

namespace vergence::mock {

/// Times of pulses that somebody else makes, on their way to the scheduler.
///
/// Threads  push(), end(): who feeds. next(): the scheduler's producer. wake(): any.
/// Memory   Grows with what is not taken.
class PulseFeed {
 public:
  /// `stop`: next() ends. It outlives the feed; wake() follows its setting.
  explicit PulseFeed(const std::atomic<bool>& stop) : stop_(stop) {}

  /// Since the drive's start. Nothing happens after end().
  void push(Duration time) {
    {
      const std::lock_guard lock(mutex_);
      if (!over_) times_.push(time);
    }
    changed_.notify_all();
  }
  void end() noexcept {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    changed_.notify_all();
  }
  void wake() noexcept {
    { const std::lock_guard lock(mutex_); }
    changed_.notify_all();
  }
  /// Waits for it; nothing: there is no more, or it was stopped.
  [[nodiscard]] std::optional<Duration> next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !times_.empty() || over_ || stop_; });
    if (times_.empty() || stop_) return std::nullopt;
    const Duration time = times_.front();
    times_.pop();
    return time;
  }

 private:
  const std::atomic<bool>& stop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::queue<Duration> times_;
  bool over_ = false;
};

}  // namespace vergence::mock
