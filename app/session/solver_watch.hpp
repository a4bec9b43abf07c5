#pragma once
#include <optional>

#include "core/types/parallel.hpp"

namespace vergence::app {

/// The calibration solver's runner, with a note of the frames at which it was found idle: the one
/// thing by which time decides what the estimator does. With that note it answers in a replay as it
/// did in the drive.
///
/// Threads  As BackgroundRunner; begin_frame(), found_idle(): the same one. Memory: none.
class SolverWatch final : public BackgroundRunner {
 public:
  explicit SolverWatch(BackgroundRunner& solver) noexcept : solver_(solver) {}

  /// Before Estimator::process(). `idle_then`: of a replay, what was found at this frame of the
  /// drive: busy() says the same, waiting where the solver is slower now.
  void begin_frame(std::optional<bool> idle_then) noexcept {
    idle_then_ = idle_then;
    found_idle_ = false;
  }
  /// busy() was asked since begin_frame(), and the task was done.
  [[nodiscard]] bool found_idle() const noexcept { return found_idle_; }

  void start(TaskRef task) noexcept override { solver_.start(task); }
  [[nodiscard]] bool busy() noexcept override {
    if (idle_then_ && !*idle_then_) return true;
    if (idle_then_) solver_.wait();
    const bool busy = solver_.busy();
    found_idle_ = found_idle_ || !busy;
    return busy;
  }
  void wait() noexcept override { solver_.wait(); }

 private:
  BackgroundRunner& solver_;
  std::optional<bool> idle_then_{};
  bool found_idle_ = false;
};

}  // namespace vergence::app
