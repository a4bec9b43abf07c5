#include "app/runtime/background_thread.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cassert>

#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

constexpr int kNice =
    5;  // a third of the share of a thread at 0: poses come first, and the solver still ends

/// On Linux the priority is the calling thread's own, in spite of the name. A refusal costs nothing
/// but that share.
void yield_to_others() noexcept {
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
}

}  // namespace

BackgroundThread::BackgroundThread() : thread_([this] { work(); }) {}

BackgroundThread::~BackgroundThread() {
  wait();
  stop_ = true;
  asked_.fetch_add(1, std::memory_order_release);
  asked_.notify_one();
  thread_.join();
}

void BackgroundThread::start(TaskRef task) noexcept {
  assert(!busy());
  task_ = task;
  asked_.fetch_add(1, std::memory_order_release);
  asked_.notify_one();
}

bool BackgroundThread::busy() noexcept {
  return done_.load(std::memory_order_acquire) != asked_.load(std::memory_order_relaxed);
}

void BackgroundThread::wait() noexcept {
  const std::uint32_t asked = asked_.load(std::memory_order_relaxed);
  for (std::uint32_t done = done_.load(std::memory_order_acquire); done != asked;
       done = done_.load(std::memory_order_acquire))
    done_.wait(done, std::memory_order_acquire);
}

void BackgroundThread::work() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-calib");
  yield_to_others();
  AllocationGuard::seal_thread();
  for (std::uint32_t answered = 0;; ++answered) {
    asked_.wait(answered, std::memory_order_acquire);
    if (stop_) return;
    (*task_)();
    done_.fetch_add(1, std::memory_order_release);
    done_.notify_one();
  }
}

}  // namespace vergence::app
