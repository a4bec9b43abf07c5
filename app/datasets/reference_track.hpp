#pragma once
#include <algorithm>
#include <optional>
#include <span>

#include "core/types/stamped_pose.hpp"

namespace vergence::app {

/// Interpolates a reference trajectory. Precondition: stamps increase, which the readers ensure.
/// The poses must outlive it. Does not allocate; O(log n).
class ReferenceTrack {
 public:
  /// `max_gap` is the longest gap that is bridged, as in `vergence evaluate`.
  explicit ReferenceTrack(std::span<const StampedPose> poses,
                          Duration max_gap = Duration::milliseconds(200)) noexcept
      : poses_(poses), max_gap_(max_gap) {}

  /// Interpolates the position linearly and the rotation along the shorter arc. Empty outside the
  /// trajectory and in gaps.
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
