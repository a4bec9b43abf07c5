#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/recording/cdr_writer.hpp"
#include "core/math/se3.hpp"
#include "core/types/calibration.hpp"
#include "core/types/image.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"
#include "drivers/ins.hpp"
#include "drivers/trigger.hpp"

/// The ROS 2 messages of a recording and of ROS topics (app/ros2), written into bytes that are
/// given. No heap, no exceptions: made on the estimator's thread. What does not fit leaves
/// CdrWriter::ok() false.
namespace vergence::app {

/// Bytes that a message takes at most, but for its texts and data.
inline constexpr std::size_t kMessageRoom = 1024;

/// CRC-32 as zip has it.
[[nodiscard]] std::uint32_t crc32_of(std::span<const std::uint8_t> bytes) noexcept;

/// sensor_msgs/Image, mono8, rows without padding.
void write_image(CdrWriter* out, Stamp stamp, std::string_view frame,
                 const ImageView& image) noexcept;
/// Size of a message of write_image().
[[nodiscard]] constexpr std::size_t image_message_size(int width, int height,
                                                       std::size_t frame) noexcept {
  return 64 + frame + static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

/// sensor_msgs/CameraInfo of camera `camera`: k and d of the lens; r and p those of the pair that
/// rectifies it with camera 0 where a calibration is there, else r the identity and p of k.
void write_camera_info(CdrWriter* out, Stamp stamp, std::string_view frame,
                       const RigCalibration& rig, int camera, bool calibrated) noexcept;

/// A place on the earth.
struct FixMessage {
  enum class Known : std::uint8_t { no, approximated, diagonal, all };

  bool fix = false;
  /// Height above the ellipsoid.
  Geodetic position{};
  /// East, north, up, m², row by row.
  std::array<double, 9> covariance{};
  /// Known part of the covariance.
  Known known = Known::no;
};
void write_nav_sat_fix(CdrWriter* out, Stamp stamp, std::string_view frame,
                       const FixMessage& fix) noexcept;
/// Position of a reading; altitude above the ellipsoid, covariance east, north, up from its sigmas.
void write_nav_sat_fix(CdrWriter* out, const InsSample& sample) noexcept;
/// Attitude of a reading: body forward, left, up in east, north, up. Rates and accelerations are
/// not measured, which their covariances say.
void write_imu(CdrWriter* out, const InsSample& sample) noexcept;
/// All of a reading, bit for bit.
void write_ins_reading(CdrWriter* out, const InsSample& sample, const InsQuality& quality) noexcept;

/// Pose of `child` in the frame of the header, twist about the axes of `child`. Covariances row by
/// row: translation, rotation.
struct OdometryMessage {
  Transform pose{};
  std::array<double, 36> pose_covariance{};
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();  // m/s, rad/s
  std::array<double, 36> twist_covariance{};
};
void write_odometry(CdrWriter* out, Stamp stamp, std::string_view frame, std::string_view child,
                    const OdometryMessage& odometry) noexcept;
/// Pose of the left camera in `world` with its covariance (PoseSample), −1 in its first number
/// where the pose is not to be used. The speed is not measured: −1 always.
void write_odometry(CdrWriter* out, const PoseSample& sample) noexcept;
/// geometry_msgs/PoseWithCovarianceStamped.
void write_pose_with_covariance(CdrWriter* out, Stamp stamp, std::string_view frame,
                                const Transform& pose,
                                const std::array<double, 36>& covariance) noexcept;

/// Where `child` is in `parent`.
struct NamedTransform {
  std::string_view parent{}, child{};
  Transform T_parent_child{};
};
/// tf2_msgs/TFMessage.
void write_transforms(CdrWriter* out, Stamp stamp,
                      std::span<const NamedTransform> transforms) noexcept;
/// `world` → `left` of a frame that has a pose.
void write_pose_transform(CdrWriter* out, const PoseSample& sample) noexcept;
/// `left` → every other camera. `names`: the frames of the cameras.
void write_rig_transforms(CdrWriter* out, Stamp stamp, const RigCalibration& rig,
                          std::span<const std::string_view> names) noexcept;

void write_text(CdrWriter* out, std::string_view text) noexcept;  // std_msgs/String

/// One diagnostic_msgs/DiagnosticStatus.
struct DiagnosticMessage {
  enum class Level : std::uint8_t { ok, warn, error, stale };

  Level level = Level::ok;
  std::string name{}, message{};
  std::vector<std::pair<std::string, std::string>> values{};
};
/// diagnostic_msgs/DiagnosticArray.
void write_diagnostics(CdrWriter* out, Stamp stamp,
                       std::span<const DiagnosticMessage> diagnostics) noexcept;

/// Input of one estimator call apart from the images, and its result.
struct FrameRecord {
  std::uint64_t number = 0;
  Stamp stamp{};
  Duration stamp_error{}, spread{};
  int cameras = 0;
  std::uint8_t pairing = 0;                            // as a Pairing
  std::uint8_t images_present = 0;                     // mask by camera: the estimator had one
  std::uint8_t images_recorded = 0;                    // mask by camera: it is in the recording
  std::array<std::uint32_t, kMaxCameras> image_crc{};  // CRC-32 of their pixels
  bool recalibration_requested = false;                // before this frame
  bool solver_done = false;  // the calibration solver answered at this frame
  PoseSample sample{};
};
void write_frame(CdrWriter* out, const FrameRecord& frame) noexcept;
/// As the board reported it, `stamp` the arrival of that; `edge`: pulse.host on the session's
/// clock.
void write_pulse(CdrWriter* out, Stamp stamp, const Pulse& pulse, Stamp edge) noexcept;

/// Types of the messages in a recording and of ROS topics (app/ros2). Those of `vergence_msgs` are
/// this project's own: what a replay needs and no standard message can hold. Their definitions
/// stand in the file like all others.
enum class RosType : std::uint8_t {
  image,
  camera_info,
  nav_sat_fix,
  imu,
  odometry,
  tf,
  text,
  frame,        // vergence_msgs/msg/Frame
  ins_reading,  // vergence_msgs/msg/InsReading
  pulse,        // vergence_msgs/msg/Pulse
  pose_with_covariance,
  diagnostics,
};
inline constexpr int kRosTypes = 12;

/// `sensor_msgs/msg/Image`.
[[nodiscard]] std::string_view ros_type_name(RosType type) noexcept;
/// Its definition and those of all types it is made of, as `ros2msg` requires in a schema.
[[nodiscard]] std::string ros_definition(RosType type);

}  // namespace vergence::app
