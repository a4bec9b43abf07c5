#pragma once
#include <cstdint>

namespace vergence {

/// Workload of a frame, reduced if it would exceed its time limit (docs/deployment.md). The pose is
/// always estimated.
struct FrameWorkload {
  static constexpr std::uint8_t kAll = 255;
  /// Share of `odometry.features` up to which new points are created.
  std::uint8_t points_percent = 100;
  /// Maximum number of newest keyframes that are adjusted; 0 for none.
  std::uint8_t window_keyframes = kAll;
  /// Maximum number of steps of the window's solver.
  std::uint8_t window_steps = kAll;

  friend bool operator==(const FrameWorkload&, const FrameWorkload&) = default;
  [[nodiscard]] bool whole() const noexcept { return *this == FrameWorkload{}; }
};

}  // namespace vergence
