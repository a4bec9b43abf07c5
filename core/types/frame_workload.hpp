#pragma once
#include <cstdint>

namespace vergence {

/// Workload of a frame: all of it, or less where its time would be over first
/// (docs/deployment.md). The pose is sought whatever is left out.
struct FrameWorkload {
  static constexpr std::uint8_t kAll = 255;
  std::uint8_t points_percent = 100;     // of `odometry.features`, up to which new points are made
  std::uint8_t window_keyframes = kAll;  // the newest so many are adjusted at most; 0: none
  std::uint8_t window_steps = kAll;      // of the window's solver at most

  friend bool operator==(const FrameWorkload&, const FrameWorkload&) = default;
  [[nodiscard]] bool whole() const noexcept { return *this == FrameWorkload{}; }
};

}  // namespace vergence
