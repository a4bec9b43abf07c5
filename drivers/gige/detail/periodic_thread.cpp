#include "drivers/gige/detail/periodic_thread.hpp"

#include <pthread.h>

#include <chrono>
#include <utility>

namespace vergence::gige {

void PeriodicThread::start(const char* name, Duration interval, std::function<void()> round) {
  if (thread_.joinable()) return;
  thread_ = std::thread(
      [this, name, interval, round = std::move(round)] { work(name, interval, round); });
}

void PeriodicThread::stop() noexcept {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
  stopping_ = false;
}

void PeriodicThread::work(const char* name, Duration interval, const std::function<void()>& round) {
  (void)pthread_setname_np(pthread_self(), name);
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      if (wake_.wait_for(lock, std::chrono::nanoseconds(interval.ns()),
                         [this] { return stopping(); }))
        return;
    }
    round();
  }
}

}  // namespace vergence::gige
