#pragma once
#include <chrono>

#include "core/types/frame_workload.hpp"
#include "core/types/time.hpp"

namespace vergence::odometry {

/// Plans the optional work of a frame within its time budget. Work is left out in this order: new
/// points, down to a quarter; keyframes of the window, down to four; steps of its solver, down to
/// one; the window. Times are predicted from the slowest recent frame.
///
/// Not thread-safe. Does not allocate. Without a budget all work is planned and no clock is read.
class WorkBudget {
 public:
  using Clock = std::chrono::steady_clock;

  /// Starts the clock of a frame. A `budget` of zero means no limit.
  void begin(Duration budget) noexcept;
  /// Returns the work that fits, for a window of `keyframes` and `steps` solver steps.
  [[nodiscard]] FrameWorkload plan(int keyframes, int steps) const noexcept;
  [[nodiscard]] bool limited() const noexcept { return budget_ms_ > 0; }

  /// Report the measured times of new points and of a window.
  void add_points_time(double ms, const FrameWorkload& effort) noexcept;
  void add_window_time(double ms, int keyframes, int steps) noexcept;

 private:
  double budget_ms_ = 0;
  Clock::time_point start_{};
  // Time of new points at 100 %.
  double points_ms_ = 0;
  // Time of one step of one keyframe.
  double window_step_ms_ = 0;
};

}  // namespace vergence::odometry
