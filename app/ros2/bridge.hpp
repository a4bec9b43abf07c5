#pragma once
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json_fwd.hpp>

#include "app/recording/messages.hpp"
#include "core/comparison/geodesy.hpp"

namespace vergence::app::ros2 {

/// Receiver of messages: DDS, or a test.
class TopicWriter {
 public:
  virtual ~TopicWriter() = default;
  /// Announces a topic such as `/tf`; has no effect if repeated. With `latched`, late readers get
  /// the last message.
  virtual void advertise(const std::string& topic, RosType type, bool latched) = 0;
  /// Publishes a message with its encapsulation. The topic must be announced.
  virtual void publish(const std::string& topic, std::span<const std::uint8_t> cdr) = 0;
};

/// Frames and topics (drawn in docs/ros2.md).
struct BridgeOptions {
  /// Prefix of topics that are not ROS's own.
  std::string name_space = "/vergence";
  std::string odom_frame = "odom", base_frame = "base_link", enu_frame = "enu";
  /// If true, the child of odometry is the left camera's optical frame.
  bool camera_child = false;
  /// Publishes odom → child.
  bool publish_tf = true;
  /// Publishes image_raw of the left and right camera.
  bool images = false;
  /// Pose of the left camera's optical axes in base_frame.
  Transform T_base_left{};
};

/// Converts lines of the pose stream, version 2, to ROS 2 messages. Not thread-safe. Throws
/// InputError for another version; malformed lines are ignored and counted.
class Bridge {
 public:
  /// Version of the pose stream.
  static constexpr int kVersion = 2;

  /// Response to a request.
  struct Response {
    bool accepted = false;
    std::string message{};
  };

  /// Announces all topics except those of cameras, whose names come with the calibration. `writer`
  /// must outlive it.
  Bridge(const BridgeOptions& options, TopicWriter* writer);
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  /// Adds a line without its line feed. Returns the response that it contains.
  std::optional<Response> add(std::string_view line);
  /// Handles the line before an image; others have no effect. Returns the image's size in bytes.
  std::size_t begin_image(std::string_view line);
  /// Handles the pixels that followed. camera_info gets the image's stamp, because
  /// stereo_image_proc requires equal stamps. Without a calibration nothing is published.
  void end_image(std::string_view pixels);
  /// Called after a disconnect, because velocities are not measured across it.
  void disconnected() noexcept { previous_.reset(); }
  /// Publishes diagnostics of level STALE with the reason `message`.
  void publish_stale(Stamp now, const std::string& message);
  /// Number of ignored lines, and of status lines, since the start.
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }
  [[nodiscard]] std::uint64_t statuses() const noexcept { return statuses_; }

 private:
  // Order: translation, rotation.
  using Covariance = Eigen::Matrix<double, 6, 6>;

  struct PosedChild {
    Stamp stamp{};
    Transform T_odom_child{};
  };
  struct Alignment {
    Transform T_enu_world{};
    LocalTangentPlane plane{};
    // In m² and rad².
    Vec3 position_variance = Vec3::Zero(), rotation_variance = Vec3::Zero();
  };

  void on_pose(const nlohmann::json& line);
  void on_calibration(const nlohmann::json& line);
  void on_alignment(const nlohmann::json& line);
  void on_status(const nlohmann::json& line);
  void publish_camera_info(std::size_t camera, Stamp stamp);
  [[nodiscard]] std::string camera_topic(std::size_t camera, const char* name) const {
    return fmt::format("{}/{}/{}", options_.name_space, names_[camera], name);
  }

  void measure_twist(const nlohmann::json& line, const PosedChild& now, double widening,
                     OdometryMessage* odometry) const;
  void publish_in_enu(Stamp stamp, const Transform& T_world_left, const Covariance& covariance);
  template <class Write>
  void publish(const std::string& topic, const Write& write);

  const BridgeOptions options_;
  TopicWriter* const writer_;
  // Transforms of the odometry's frames, and of the child in the left camera's frame.
  const Transform T_odom_world_, T_left_child_;
  std::string child_frame_;
  const std::string odometry_topic_, fix_topic_, pose_enu_topic_;

  std::optional<PosedChild> previous_{};
  std::optional<Alignment> alignment_{};
  // Newest calibration line, and its rating; empty if there is none.
  std::string calibration_text_{}, rating_{};
  // Rig of the newest line.
  RigCalibration rig_{};
  // Names of its cameras, as parts of topics and frames.
  std::vector<std::string> names_{};
  // Image whose pixels follow.
  struct {
    std::size_t camera = 0;
    Stamp stamp{};
    int width = 0, height = 0;
  } image_;
  std::uint64_t malformed_ = 0, statuses_ = 0, dropped_ = 0;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace vergence::app::ros2
