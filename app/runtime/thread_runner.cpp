#include "app/runtime/thread_runner.hpp"

#include <pthread.h>

#include <chrono>

#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

constexpr std::chrono::microseconds kSpin{20};  // a wake-up through the kernel costs 5 to 50 µs

void relax() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Returns when `counter` is no longer `old`: spins first, then sleeps.
void await_change(const std::atomic<std::uint32_t>& counter, std::uint32_t old) noexcept {
  constexpr int kPausesPerLook = 32;  // about 1 µs: reading the clock is not for free
  const auto until = std::chrono::steady_clock::now() + kSpin;
  do {
    for (int i = 0; i < kPausesPerLook; ++i) {
      if (counter.load(std::memory_order_acquire) != old) return;
      relax();
    }
  } while (std::chrono::steady_clock::now() < until);
  counter.wait(old, std::memory_order_acquire);
}

}  // namespace

ThreadRunner::ThreadRunner(Worker worker) : worker_([this, worker] { work(worker); }) {}

ThreadRunner::~ThreadRunner() {
  stop_ = true;
  asked_.fetch_add(1, std::memory_order_release);
  asked_.notify_one();
  worker_.join();
}

void ThreadRunner::run(TaskRef here, TaskRef there) noexcept {
  const std::uint32_t before = done_.load(std::memory_order_relaxed);
  task_ = &there;
  asked_.fetch_add(1, std::memory_order_release);
  asked_.notify_one();
  here();
  await_change(done_, before);
}

void ThreadRunner::work(Worker worker) noexcept {
  (void)pthread_setname_np(pthread_self(),
                           worker == Worker::of_estimator ? "vergence-front" : "vergence-right");
  if (worker == Worker::of_estimator) AllocationGuard::seal_thread();
  for (std::uint32_t answered = 0;; ++answered) {
    await_change(asked_, answered);
    if (stop_) return;
    (*task_)();
    done_.fetch_add(1, std::memory_order_release);
    done_.notify_one();
  }
}

}  // namespace vergence::app
