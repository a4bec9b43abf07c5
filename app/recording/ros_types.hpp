#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace vergence::app {

/// Types of the messages in a recording. Those of `vergence_msgs` are this project's own: what a
/// replay needs and no standard message can hold. Their definitions stand in the file like all
/// others.
enum class RosType : std::uint8_t {
  image,
  compressed_image,
  camera_info,
  nav_sat_fix,
  imu,
  odometry,
  diagnostics,
  tf,
  text,
  frame,        // vergence_msgs/msg/Frame
  ins_reading,  // vergence_msgs/msg/InsReading
  pulse,        // vergence_msgs/msg/Pulse
};
inline constexpr int kRosTypes = 12;

/// `sensor_msgs/msg/Image`.
[[nodiscard]] std::string_view ros_type_name(RosType type) noexcept;
/// Its definition and those of all types it is made of, as `ros2msg` wants them in a schema.
[[nodiscard]] std::string ros_definition(RosType type);

}  // namespace vergence::app
