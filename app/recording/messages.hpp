#pragma once
#include <string>
#include <utility>
#include <vector>

#include "app/recording/cdr_writer.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"
#include "drivers/ins.hpp"
#include "drivers/trigger.hpp"

/// ROS 2 messages of a recording and of ROS topics (app/ros2), written into given bytes on the
/// estimator's thread, without heap or exceptions. A message that does not fit leaves
/// CdrWriter::ok() false.
namespace vergence::app {

/// Maximum size of a message without its texts and data, in bytes.
inline constexpr std::size_t kMessageRoom = 1024;

/// CRC-32 as in zip.
[[nodiscard]] std::uint32_t crc32_of(std::span<const std::uint8_t> bytes) noexcept;

/// Writes a sensor_msgs/Image, mono8, rows without padding.
void write_image(CdrWriter* out, Stamp stamp, std::string_view frame,
                 const ImageView& image) noexcept;
/// Size of a message of write_image() in bytes.
[[nodiscard]] constexpr std::size_t image_message_size(int width, int height,
                                                       std::size_t frame) noexcept {
  return 64 + frame + static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

/// Rectification of a pair as in sensor_msgs/CameraInfo: x along the baseline, z between the
/// optical axes.
struct Rectification {
  /// From the camera to the common axes.
  Mat3 R = Mat3::Identity();
  /// Projection of rectified images, in px and px·m.
  Mat34 P;
};
/// Rectification of `camera` in the pair with camera 0; for camera 0 in the pair with camera 1.
/// Without a calibration R is the identity and P has the camera's own intrinsics.
[[nodiscard]] Rectification rectification(const RigCalibration& rig, int camera,
                                          bool calibrated) noexcept;

/// Writes a sensor_msgs/CameraInfo: k and d of the intrinsics. With a calibration r and p rectify
/// the camera with camera 0; otherwise r is the identity and p is k.
void write_camera_info(CdrWriter* out, Stamp stamp, std::string_view frame,
                       const RigCalibration& rig, int camera, bool calibrated) noexcept;

/// Position on the earth.
struct FixMessage {
  enum class Known : std::uint8_t { no, approximated, diagonal, all };

  bool fix = false;
  /// Height above the ellipsoid.
  Geodetic position{};
  /// East, north, up in m², row-major.
  std::array<double, 9> covariance{};
  /// Known part of the covariance.
  Known known = Known::no;
};
void write_nav_sat_fix(CdrWriter* out, Stamp stamp, std::string_view frame,
                       const FixMessage& fix) noexcept;
/// Writes the position of a sample: altitude above the ellipsoid, covariance east, north, up from
/// its sigmas.
void write_nav_sat_fix(CdrWriter* out, const InsSample& sample) noexcept;
/// Writes the attitude of a sample: body forward, left, up in east, north, up. The covariances mark
/// rates and accelerations as not measured.
void write_imu(CdrWriter* out, const InsSample& sample) noexcept;
/// Writes a complete sample without loss.
void write_ins_reading(CdrWriter* out, const InsSample& sample, const InsQuality& quality) noexcept;

/// Pose of `child` in the header's frame, twist in the axes of `child`. Covariances are row-major:
/// translation, rotation.
struct OdometryMessage {
  Transform pose{};
  std::array<double, 36> pose_covariance{};
  /// In m/s and rad/s.
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  std::array<double, 36> twist_covariance{};
};
void write_odometry(CdrWriter* out, Stamp stamp, std::string_view frame, std::string_view child,
                    const OdometryMessage& odometry) noexcept;
/// Writes the pose of the left camera in `world` with its covariance (PoseSample), −1 in the first
/// element if the pose must not be used. The twist is not measured and always has −1.
void write_odometry(CdrWriter* out, const PoseSample& sample) noexcept;
/// Writes a geometry_msgs/PoseWithCovarianceStamped.
void write_pose_with_covariance(CdrWriter* out, Stamp stamp, std::string_view frame,
                                const Transform& pose,
                                const std::array<double, 36>& covariance) noexcept;

/// Transform between two named frames.
struct NamedTransform {
  std::string_view parent{}, child{};
  Transform T_parent_child{};
};
/// Writes a tf2_msgs/TFMessage.
void write_transforms(CdrWriter* out, Stamp stamp,
                      std::span<const NamedTransform> transforms) noexcept;
/// Writes `world` → `left` of a frame with a pose.
void write_pose_transform(CdrWriter* out, const PoseSample& sample) noexcept;
/// Writes `left` → every other camera. `names` are the frames of the cameras.
void write_rig_transforms(CdrWriter* out, Stamp stamp, const RigCalibration& rig,
                          std::span<const std::string> names) noexcept;

/// Writes a std_msgs/String.
void write_text(CdrWriter* out, std::string_view text) noexcept;

/// Content of a diagnostic_msgs/DiagnosticStatus.
struct DiagnosticMessage {
  enum class Level : std::uint8_t { ok, warn, error, stale };

  Level level = Level::ok;
  std::string name{}, message{};
  std::vector<std::pair<std::string, std::string>> values{};
};
/// Writes a diagnostic_msgs/DiagnosticArray.
void write_diagnostics(CdrWriter* out, Stamp stamp,
                       std::span<const DiagnosticMessage> diagnostics) noexcept;

/// Input of one estimator call apart from the images, and its result.
struct FrameRecord {
  std::uint64_t number = 0;
  Stamp stamp{};
  Duration stamp_error{}, spread{};
  int cameras = 0;
  /// Value of a Pairing.
  std::uint8_t pairing = 0;
  /// Bit k is set if the estimator had the image of camera k.
  std::uint8_t images_present = 0;
  /// Bit k is set if the image of camera k is recorded.
  std::uint8_t images_recorded = 0;
  /// CRC-32 of the pixels.
  std::array<std::uint32_t, kMaxCameras> image_crc{};
  /// True if requested before this frame.
  bool recalibration_requested = false;
  /// True if the calibration solver was idle at this frame.
  bool solver_done = false;
  PoseSample sample{};
};
void write_frame(CdrWriter* out, const FrameRecord& frame) noexcept;
/// Writes a pulse. `stamp` is the arrival of its report, `edge` is pulse.host on the session's
/// clock.
void write_pulse(CdrWriter* out, Stamp stamp, const Pulse& pulse, Stamp edge) noexcept;

/// Types of messages in recordings and of ROS topics (app/ros2). Those of `vergence_msgs` hold
/// replay data that no standard message can; their definitions are in the file like all others.
enum class RosType : std::uint8_t {
  image,
  camera_info,
  nav_sat_fix,
  imu,
  odometry,
  tf,
  text,
  /// Type vergence_msgs/msg/Frame.
  frame,
  /// Type vergence_msgs/msg/InsReading.
  ins_reading,
  /// Type vergence_msgs/msg/Pulse.
  pulse,
  pose_with_covariance,
  diagnostics,
};
inline constexpr int kRosTypes = 12;

/// Name such as `sensor_msgs/msg/Image`.
[[nodiscard]] std::string_view ros_type_name(RosType type) noexcept;
/// Definition of the type and its parts, as `ros2msg` requires in a schema.
[[nodiscard]] std::string ros_definition(RosType type);

}  // namespace vergence::app
