#pragma once
#include <algorithm>
#include <optional>
#include <span>

#include "core/math/se3.hpp"
#include "core/types/stamped_pose.hpp"

namespace vergence::app {

/// A reference trajectory asked for the pose at a time. Stamps ascend (precondition, the readers
/// see to it).
///
/// Ownership  The poses outlive it.  Threads  Const.  Memory  None: callable on a sealed thread.
/// O(log n).
class ReferenceTrack {
 public:
  /// `max_gap`: the widest hole that is bridged; the same as vergence evaluate's.
  explicit ReferenceTrack(std::span<const StampedPose> poses,
                          Duration max_gap = Duration::milliseconds(200)) noexcept
      : poses_(poses), max_gap_(max_gap) {}

  /// Position linear, rotation along the shorter arc. Nothing outside the trajectory and in holes.
  [[nodiscard]] std::optional<Transform> at(Stamp stamp) const noexcept {
    const auto after = std::lower_bound(poses_.begin(), poses_.end(), stamp,
                                        [](const StampedPose& p, Stamp s) { return p.stamp < s; });
    if (after == poses_.end()) return std::nullopt;
    if (after->stamp == stamp) return after->T_world_body;
    if (after == poses_.begin()) return std::nullopt;
    const auto before = after - 1;
    const Duration hole = after->stamp - before->stamp;
    if (hole > max_gap_) return std::nullopt;
    return interpolate(before->T_world_body, after->T_world_body,
                       (stamp - before->stamp).to_seconds() / hole.to_seconds());
  }

 private:
  std::span<const StampedPose> poses_;
  Duration max_gap_;
};

}  // namespace vergence::app
