#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <mutex>

#include "core/types/time.hpp"

namespace vergence::mock {

/// How far the deliveries of a rig in virtual time have come.
///
/// Threads  advance(), restart(): the one that delivers. wait_for(): any.
class DeliveryProgress {
 public:
  void restart() noexcept { set(std::numeric_limits<std::int64_t>::min()); }
  /// Everything that arrives before `instant` has been delivered.
  void advance(HostStamp instant) noexcept { set(instant.ns()); }
  /// Whether that is so of this instant, after at most `limit`.
  [[nodiscard]] bool wait_for(HostStamp instant, Duration limit) noexcept {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::nanoseconds(limit.ns()),
                             [&] { return until_ns_ >= instant.ns(); });
  }

 private:
  void set(std::int64_t until_ns) noexcept {
    {
      const std::lock_guard lock(mutex_);
      until_ns_ = until_ns;
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::int64_t until_ns_ = std::numeric_limits<std::int64_t>::min();
};

}  // namespace vergence::mock
