#include "app/runtime/background_thread.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cassert>
#include <chrono>

#include "core/memory/allocation_guard.hpp"

namespace vergence::app {

namespace {

constexpr int kNice =
    5;  // a third of the share of a thread at 0: poses come first, and the solver still ends
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
  constexpr int kPausesPerPoll = 32;  // about 1 µs: reading the clock is not for free
  const auto until = std::chrono::steady_clock::now() + kSpin;
  do {
    for (int i = 0; i < kPausesPerPoll; ++i) {
      if (counter.load(std::memory_order_acquire) != old) return;
      relax();
    }
  } while (std::chrono::steady_clock::now() < until);
  counter.wait(old, std::memory_order_acquire);
}

constexpr std::array kNames{"vergence-calib", "vergence-front", "vergence-right"};  // by Role

}  // namespace

BackgroundThread::BackgroundThread(Role role) : thread_([this, role] { work(role); }) {}

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
  if (busy()) await_change(done_, asked_.load(std::memory_order_relaxed) - 1);
}

void BackgroundThread::work(Role role) noexcept {
  (void)pthread_setname_np(pthread_self(), kNames.at(static_cast<std::size_t>(role)));
  // On Linux the priority is the calling thread's own, in spite of the name. A refusal costs
  // nothing but that share.
  if (role == Role::solver) (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
  if (role != Role::reader) AllocationGuard::seal_thread();
  for (std::uint32_t answered = 0;; ++answered) {
    await_change(asked_, answered);
    if (stop_) return;
    (*task_)();
    done_.fetch_add(1, std::memory_order_release);
    done_.notify_one();
  }
}

}  // namespace vergence::app
