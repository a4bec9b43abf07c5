#include "app/recording/ros_types.hpp"

#include <array>
#include <set>
#include <vector>

namespace vergence::app {
namespace {

/// Fields of the packages common_interfaces and geometry2 as of ROS 2 Humble, without their
/// comments and constants.
struct Definition {
  std::string_view name;  // without /msg/, as fields name it
  std::string_view fields;
};
constexpr std::array kDefinitions{
    Definition{"sensor_msgs/Image",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
               "uint8 is_bigendian\nuint32 step\nuint8[] data\n"},
    Definition{"sensor_msgs/CompressedImage",
               "std_msgs/Header header\nstring format\nuint8[] data\n"},
    Definition{"sensor_msgs/CameraInfo",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
               "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n"
               "uint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"},
    Definition{"sensor_msgs/NavSatFix",
               "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\n"
               "float64 longitude\nfloat64 altitude\nfloat64[9] position_covariance\n"
               "uint8 position_covariance_type\n"},
    Definition{"sensor_msgs/Imu",
               "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
               "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
               "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
               "float64[9] linear_acceleration_covariance\n"},
    Definition{"nav_msgs/Odometry",
               "std_msgs/Header header\nstring child_frame_id\n"
               "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n"},
    Definition{"diagnostic_msgs/DiagnosticArray",
               "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
    Definition{"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    Definition{"std_msgs/String", "string data\n"},
    // What one call of the estimator was given and what came of it: all that a replay needs beside
    // the images. `crc` is the CRC-32 of the message's bytes before it, `image_crc` that of pixels.
    Definition{"vergence_msgs/Frame",
               "std_msgs/Header header\nuint64 number\nint64 stamp_ns\nint64 stamp_error_ns\n"
               "int64 spread_ns\nuint8 pairing\nuint8 cameras\nuint8 images_present\n"
               "uint8 images_recorded\nuint32[] image_crc\nbool recalibration_requested\n"
               "bool solver_done\nuint8 state\nuint8 status\nuint8 reason\n"
               "geometry_msgs/Pose pose\nint32 inliers\nfloat64 reprojection_px\n"
               "float32 estimate_ms\nuint8 points_percent\nuint8 window_keyframes\n"
               "uint8 window_steps\nuint32 crc\n"},
    // A reading of the INS on the host's clock. Body forward, left, up; axes east, north, up.
    Definition{"vergence_msgs/InsReading",
               "std_msgs/Header header\nuint64 number\nint64 stamp_ns\nint64 stamp_error_ns\n"
               "uint8 fix\nbool attitude_valid\nbool velocity_valid\nfloat64 latitude_deg\n"
               "float64 longitude_deg\nfloat64 height_m\nfloat64[3] velocity_enu\n"
               "float64[4] q_enu_ins\nfloat64 position_sigma\nfloat64 height_sigma\n"
               "float64 velocity_sigma\nfloat64 tilt_sigma\nfloat64 heading_sigma\n"
               "uint32 device_status\nbool utc_valid\nint64 utc_ns\nuint8 satellites\n"
               "float32 position_dop\nbool filter_valid\nbool sync_out\nuint32 crc\n"},
    Definition{"vergence_msgs/Pulse",
               "std_msgs/Header header\nuint64 number\nuint32 boot\nint64 edge_device_ns\n"
               "int64 arrival_host_ns\nbool resumed\nuint8 exposures_seen\n"
               "int64[] exposure_start_ns\nint64[] exposure_end_ns\nbool mapped\n"
               "int64 edge_ns\nint64 edge_error_ns\n"},
    // What those are made of.
    Definition{"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    Definition{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    Definition{"sensor_msgs/RegionOfInterest",
               "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    Definition{"sensor_msgs/NavSatStatus", "int8 status\nuint16 service\n"},
    Definition{"geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    Definition{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Pose",
               "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    Definition{"geometry_msgs/PoseWithCovariance",
               "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/Twist",
               "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    Definition{"geometry_msgs/TwistWithCovariance",
               "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/Transform",
               "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    Definition{"geometry_msgs/TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\n"
               "geometry_msgs/Transform transform\n"},
    Definition{"diagnostic_msgs/DiagnosticStatus",
               "byte level\nstring name\nstring message\nstring hardware_id\n"
               "diagnostic_msgs/KeyValue[] values\n"},
    Definition{"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
};

constexpr std::array<std::string_view, kRosTypes> kNames{"sensor_msgs/msg/Image",
                                                         "sensor_msgs/msg/CompressedImage",
                                                         "sensor_msgs/msg/CameraInfo",
                                                         "sensor_msgs/msg/NavSatFix",
                                                         "sensor_msgs/msg/Imu",
                                                         "nav_msgs/msg/Odometry",
                                                         "diagnostic_msgs/msg/DiagnosticArray",
                                                         "tf2_msgs/msg/TFMessage",
                                                         "std_msgs/msg/String",
                                                         "vergence_msgs/msg/Frame",
                                                         "vergence_msgs/msg/InsReading",
                                                         "vergence_msgs/msg/Pulse"};

const Definition* find(std::string_view name) {
  for (const Definition& d : kDefinitions)
    if (d.name == name) return &d;
  return nullptr;
}

/// Types that the lines of a definition begin with.
std::vector<std::string_view> parts(std::string_view fields) {
  std::vector<std::string_view> out;
  while (!fields.empty()) {
    const std::size_t end = fields.find('\n');
    std::string_view type = fields.substr(0, fields.find(' '));
    type = type.substr(0, type.find('['));
    if (type.find('/') != std::string_view::npos) out.push_back(type);
    fields.remove_prefix(end + 1);
  }
  return out;
}

}  // namespace

std::string_view ros_type_name(RosType type) noexcept {
  return kNames[static_cast<std::size_t>(type)];
}

std::string ros_definition(RosType type) {
  std::string name(ros_type_name(type));
  name.erase(name.find("/msg"), 4);
  const Definition* top = find(name);
  std::string text(top->fields);
  std::vector<std::string_view> open = parts(top->fields);
  std::set<std::string_view> written;
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (!written.insert(open[i]).second) continue;
    const Definition* part = find(open[i]);
    text += std::string(80, '=') + "\nMSG: " + std::string(part->name) + "\n";
    text += part->fields;
    const auto more = parts(part->fields);
    open.insert(open.end(), more.begin(), more.end());
  }
  return text;
}

}  // namespace vergence::app
