#include "core/odometry/work_budget.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::odometry {
namespace {

// Share of the budget for the odometry.
constexpr double kUsable = 0.9;
// Decay per keyframe of the slowest time of a piece of work.
constexpr double kDecay = 0.8;
// Minimum percentage of new points; with fewer, tracking is eventually lost.
constexpr double kMinPoints = 25;
constexpr int kMinKeyframes = 4;

void take(double ms, double* dearest) noexcept { *dearest = std::max(ms, kDecay * *dearest); }

}  // namespace

void WorkBudget::begin(Duration budget) noexcept {
  budget_ms_ = kUsable * budget.to_seconds() * 1e3;
  if (limited()) start_ = Clock::now();
}

FrameWorkload WorkBudget::plan(int keyframes, int steps) const noexcept {
  FrameWorkload effort;
  if (!limited()) return effort;
  double left =
      budget_ms_ - std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
  const double keyframe_ms = steps * window_step_ms_;
  const double window_ms = keyframes * keyframe_ms;
  if (points_ms_ + window_ms <= left) return effort;
  const double percent = points_ms_ > 0 ? 100.0 * (left - window_ms) / points_ms_ : kMinPoints;
  effort.points_percent =
      static_cast<std::uint8_t>(std::clamp(std::floor(percent), kMinPoints, 100.0));
  left -= 0.01 * effort.points_percent * points_ms_;
  if (window_ms <= left) return effort;
  const int fits = left > 0 ? static_cast<int>(left / keyframe_ms) : 0;
  const int newest = std::clamp(fits, std::min(kMinKeyframes, keyframes), keyframes);
  if (newest < keyframes) effort.window_keyframes = static_cast<std::uint8_t>(newest);
  if (fits >= newest) return effort;
  const int few = left > 0 ? static_cast<int>(left / (newest * window_step_ms_)) : 0;
  if (few >= 1)
    effort.window_steps = static_cast<std::uint8_t>(std::min(few, steps));
  else
    effort.window_keyframes = effort.window_steps = 0;
  return effort;
}

void WorkBudget::add_points_time(double ms, const FrameWorkload& effort) noexcept {
  take(100.0 * ms / effort.points_percent, &points_ms_);
}

void WorkBudget::add_window_time(double ms, int keyframes, int steps) noexcept {
  // The time of a window that was left out decays, so that it is tried again soon.
  take(keyframes > 0 && steps > 0 ? ms / (keyframes * steps) : 0, &window_step_ms_);
}

}  // namespace vergence::odometry
