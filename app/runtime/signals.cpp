#include "app/runtime/signals.hpp"

#include <atomic>

namespace vergence::app {
namespace {

std::atomic<int> caught{0};  // the first signal's number; all a handler may touch
static_assert(std::atomic<int>::is_always_lock_free);

extern "C" void note_signal(int number) {
  int none = 0;
  caught.compare_exchange_strong(none, number);
}

void install(int number, struct sigaction* former) {
  struct sigaction action {};
  action.sa_handler = note_signal;
  sigemptyset(&action.sa_mask);
  // Restart: a signal must not turn a write of the session into an error. Reset: the second one acts as it would by default.
  action.sa_flags = static_cast<int>(static_cast<unsigned>(SA_RESTART) | static_cast<unsigned>(SA_RESETHAND));
  sigaction(number, &action, former);  // fails only for numbers that cannot be caught
}

}  // namespace

SignalGuard::SignalGuard() {
  caught.store(0);
  install(SIGINT, &former_interrupt_);
  install(SIGTERM, &former_terminate_);
}

SignalGuard::~SignalGuard() {
  sigaction(SIGINT, &former_interrupt_, nullptr);
  sigaction(SIGTERM, &former_terminate_, nullptr);
}

bool SignalGuard::stop_requested() const noexcept { return caught.load(std::memory_order_relaxed) != 0; }

std::optional<ExitCode> SignalGuard::stop_code() const noexcept {
  switch (caught.load(std::memory_order_relaxed)) {
    case SIGINT:
      return ExitCode::interrupted;
    case SIGTERM:
      return ExitCode::terminated;
    default:
      return std::nullopt;
  }
}

}  // namespace vergence::app
