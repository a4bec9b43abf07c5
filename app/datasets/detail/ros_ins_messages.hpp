#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "app/datasets/detail/bag_scan.hpp"
#include "core/types/ins_sample.hpp"

/// The messages of ROS that an INS publishes, of ROS 2 (CDR) and ROS 1. By REP 103 the world is
/// east, north, up and a body forward, left, up. Nothing: the bytes are no such message, or a
/// number of it is none.
namespace vergence::app::detail {

/// sensor_msgs/NavSatFix.
struct RosFix {
  Stamp stamp{};
  FixStatus fix = FixStatus::none;  // fix_2d: it has no height
  std::uint8_t status = 0;          // as the message has it, as an unsigned byte
  Geodetic position{};
  double position_sigma = 0, height_sigma = 0;  // m; 0: not known
};
[[nodiscard]] std::optional<RosFix> read_ros_fix(std::span<const std::uint8_t> message,
                                                 MessageEncoding encoding);

struct RosAttitude {
  Stamp stamp{};
  std::array<double, 4> q_world_body{0, 0, 0, 1};  // unit, x y z w
  double tilt_sigma = 0, heading_sigma = 0;        // rad; 0: not known
};
/// The orientation of a sensor_msgs/Imu. Also nothing: it has none, by its covariance or its
/// length.
[[nodiscard]] std::optional<RosAttitude> read_ros_attitude(std::span<const std::uint8_t> message,
                                                           MessageEncoding encoding);

}  // namespace vergence::app::detail
