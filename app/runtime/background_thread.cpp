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

// The solver gets a third of the share of a thread with nice value 0: poses come first, and the
// solver still finishes.
constexpr int kNice = 5;
// Spinning is worthwhile because a wake-up through the kernel takes 5 to 50 µs, and because two
// passes of a bundle adjustment over its points are 30 µs apart.
constexpr std::chrono::microseconds kSpin{50};

void relax() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Returns when `counter` is no longer `old`: spins first, then sleeps.
void await_change(const std::atomic<std::uint32_t>& counter, std::uint32_t old) noexcept {
  // Pauses of about 1 µs in total, because reading the clock has a cost.
  constexpr int kPausesPerPoll = 32;
  const auto until = std::chrono::steady_clock::now() + kSpin;
  do {
    for (int i = 0; i < kPausesPerPoll; ++i) {
      if (counter.load(std::memory_order_acquire) != old) return;
      relax();
    }
  } while (std::chrono::steady_clock::now() < until);
  counter.wait(old, std::memory_order_acquire);
}

// Thread names indexed by Role.
constexpr std::array kNames{"vergence-calib", "vergence-front", "vergence-right"};

void set_up_thread(BackgroundThread::Role role) noexcept {
  using Role = BackgroundThread::Role;
  (void)pthread_setname_np(pthread_self(), kNames.at(static_cast<std::size_t>(role)));
  // On Linux the priority is the calling thread's own, in spite of the name. A refusal costs
  // nothing but that share.
  if (role == Role::solver) (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
  if (role != Role::reader) AllocationGuard::seal_thread();
}

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

void BackgroundThread::wait() noexcept {
  if (busy()) await_change(done_, asked_.load(std::memory_order_relaxed) - 1);
}

void BackgroundThread::work(Role role) noexcept {
  set_up_thread(role);
  for (std::uint32_t answered = 0;; ++answered) {
    await_change(asked_, answered);
    if (stop_) return;
    (*task_)();
    done_.fetch_add(1, std::memory_order_release);
    done_.notify_one();
  }
}

ThreadRunner::ThreadRunner(BackgroundThread::Role role) : thread_([this, role] { work(role); }) {}

ThreadRunner::~ThreadRunner() {
  state_ = ended;
  state_.notify_one();
  thread_.join();
}

void ThreadRunner::run(TaskRef here, TaskRef there) noexcept {
  there_ = there;
  // Stores are sequentially consistent, so that notify_one() sees a thread that sleeps.
  state_ = offered;
  state_.notify_one();
  here();
  std::uint32_t now = offered;
  if (state_.compare_exchange_strong(now, idle))
    there();
  else if (now == taken)
    await_change(state_, taken);
}

void ThreadRunner::work(BackgroundThread::Role role) noexcept {
  set_up_thread(role);
  for (std::uint32_t now = state_; now != ended; now = state_) {
    if (now != offered) {
      await_change(state_, now);
    } else if (state_.compare_exchange_strong(now, taken)) {
      (*there_)();
      state_ = idle;
      state_.notify_one();
    }
  }
}

std::unique_ptr<PairRunner> make_runner(int threads) {
  if (threads >= 2) return std::make_unique<ThreadRunner>();
  return std::make_unique<SequentialRunner>();
}

}  // namespace vergence::app
