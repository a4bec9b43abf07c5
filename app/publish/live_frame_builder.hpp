#pragma once
#include <optional>

#include "app/publish/live_state.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {

/// Counts a drive's frames and poses into the LiveFrame of each. One thread; no heap.
class LiveFrameBuilder {
 public:
  /// `tie`: without one ages are not known.
  void begin(const std::optional<ClockTie>& tie) noexcept { tie_ = tie; }
  /// The frame that the next pose is of; its images live as long as the caller's.
  void add(const RigFrame& frame) noexcept;
  /// Its pose, made at `now`.
  [[nodiscard]] const LiveFrame& add(const PoseSample& sample, HostStamp now) noexcept;
  [[nodiscard]] const RigFrame& frame() const noexcept { return frame_; }

 private:
  std::optional<ClockTie> tie_{};
  RigFrame frame_{};
  bool any_ = false;
  LiveFrame now_{};
  std::optional<Vec3> last_position_;
};

}  // namespace vergence::app
