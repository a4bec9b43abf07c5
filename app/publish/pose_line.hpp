#pragma once
#include <optional>
#include <string>

#include "core/comparison/comparison.hpp"
#include "core/types/pose_sample.hpp"

namespace vergence::app {

/// Where the odometry's world lies on the earth.
struct PublishedPlacement {
  Transform T_enu_world{};
  Geodetic origin{};  // of enu

  [[nodiscard]] EarthPose of(const Transform& T_world_left) const;
};

/// One JSON object and a line feed (docs/publish.md is its schema). `age_ms`: from mid-exposure
/// to now, where stamps are tied to this machine's clock. `dropped`: lines that were not made
/// since the start. `line` is replaced; its memory is used again.
void write_pose_line(const PoseSample& pose, const std::optional<EarthPose>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line);

}  // namespace vergence::app
