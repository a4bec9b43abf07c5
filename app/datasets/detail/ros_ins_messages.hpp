#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "app/datasets/detail/bag_scan.hpp"
#include "drivers/ins.hpp"

/// ROS messages of an INS, of ROS 2 (CDR) and ROS 1. By REP 103 the world is east, north, up and a
/// body forward, left, up. Readers return nothing for invalid messages or numbers.
namespace vergence::app::detail {

/// Content of sensor_msgs/NavSatFix, without an attitude. With fix_2d there is no height; sigmas
/// are 0 if unknown. The status is that of the message, as an unsigned byte.
[[nodiscard]] std::optional<InsRecord> read_ros_fix(std::span<const std::uint8_t> message,
                                                    MessageEncoding encoding);

struct RosAttitude {
  Stamp stamp{};
  /// Unit quaternion x y z w.
  std::array<double, 4> q_world_body{0, 0, 0, 1};
  /// In rad; 0 if unknown.
  double tilt_sigma = 0, heading_sigma = 0;
};
/// Orientation of a sensor_msgs/Imu. Empty also if its covariance or norm marks it as absent.
[[nodiscard]] std::optional<RosAttitude> read_ros_attitude(std::span<const std::uint8_t> message,
                                                           MessageEncoding encoding);

}  // namespace vergence::app::detail
