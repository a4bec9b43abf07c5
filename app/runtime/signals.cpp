#include "app/runtime/signals.hpp"

#include <atomic>

namespace vergence::app {
namespace {

// Number of the first signal received; a signal handler may only access atomics.
std::atomic<int> caught{0};
std::atomic<bool> calibration_asked{false};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

extern "C" void record_signal(int number) {
  int none = 0;
  caught.compare_exchange_strong(none, number);
}

extern "C" void record_calibration_request(int /*number*/) { calibration_asked.store(true); }

/// Restart: a signal must not turn a write of the session into an error. `once`: the second one
/// acts as it would by default.
void install(int number, void (*handler)(int), bool once, struct sigaction* former) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(static_cast<unsigned>(SA_RESTART) |
                                     (once ? static_cast<unsigned>(SA_RESETHAND) : 0U));
  // sigaction() fails only for signals that cannot be caught.
  sigaction(number, &action, former);
}

struct Handled {
  int number;
  void (*handler)(int);
  bool once;
};
// A reader of our output that goes, a file at its limit: the write that fails says so.
const std::array<Handled, 7> kHandled{{{SIGHUP, record_signal, true},
                                       {SIGINT, record_signal, true},
                                       {SIGTERM, record_signal, true},
                                       {SIGUSR1, record_calibration_request, false},
                                       {SIGPIPE, SIG_IGN, false},
                                       {SIGXFSZ, SIG_IGN, false},
                                       {SIGUSR2, SIG_IGN, false}}};

}  // namespace

SignalGuard::SignalGuard() {
  caught.store(0);
  calibration_asked.store(false);
  for (std::size_t i = 0; i < kHandled.size(); ++i)
    install(kHandled[i].number, kHandled[i].handler, kHandled[i].once, &former_[i]);
  // Under nohup the run continues after its terminal is closed.
  if (former_[0].sa_handler == SIG_IGN) install(SIGHUP, SIG_IGN, false, nullptr);
}

SignalGuard::~SignalGuard() {
  for (std::size_t i = 0; i < kHandled.size(); ++i)
    sigaction(kHandled[i].number, &former_[i], nullptr);
}

bool SignalGuard::stop_requested() const noexcept {
  return caught.load(std::memory_order_relaxed) != 0;
}

bool SignalGuard::poll_calibration_request() const noexcept {
  return calibration_asked.exchange(false);
}

std::optional<ExitCode> SignalGuard::stop_code() const noexcept {
  const int signal = caught.load(std::memory_order_relaxed);
  if (signal == SIGINT) return ExitCode::interrupted;
  // SIGHUP: the terminal was closed; the session is, too.
  if (signal == SIGTERM || signal == SIGHUP) return ExitCode::terminated;
  return std::nullopt;
}

}  // namespace vergence::app
