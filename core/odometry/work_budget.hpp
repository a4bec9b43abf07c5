#pragma once
#include <chrono>

#include "core/types/frame_workload.hpp"
#include "core/types/time.hpp"

namespace vergence::odometry {

/// A frame's time and what is left of it for work that the pose does not wait for. Dropped in this
/// order: new points, down to a quarter; keyframes of the window, down to four; steps of its
/// solver, down to one; the window. What a piece of work takes is taken from the frames before:
/// the dearest of late.
///
/// Threads one. No memory. Without a budget everything is done and no clock is asked.
class WorkBudget {
 public:
  using Clock = std::chrono::steady_clock;

  /// A frame begins; `budget` zero: it has all the time it needs.
  void begin(Duration budget) noexcept;
  /// What there is time for, of a window of so many keyframes and steps a keyframe.
  [[nodiscard]] FrameWorkload plan(int keyframes, int steps) const noexcept;
  [[nodiscard]] bool limited() const noexcept { return budget_ms_ > 0; }

  /// What new points and a window have taken.
  void points_took(double ms, const FrameWorkload& effort) noexcept;
  void window_took(double ms, int keyframes, int steps) noexcept;

 private:
  double budget_ms_ = 0;
  Clock::time_point start_{};
  double points_ms_ = 0;       // of all that there is room for
  double window_step_ms_ = 0;  // of one step and keyframe
};

}  // namespace vergence::odometry
