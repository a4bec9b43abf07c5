#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "app/recording/messages.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/math/se3.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app::ros2 {

/// Where messages go: a DDS, or a test.
class TopicWriter {
 public:
  virtual ~TopicWriter() = default;
  /// Announces a topic, `/tf`; again: no effect. `latched`: readers that come later get the last
  /// message.
  virtual void advertise(const std::string& topic, RosType type, bool latched) = 0;
  /// `cdr`: the message with its encapsulation. The topic was announced.
  virtual void publish(const std::string& topic, std::span<const std::uint8_t> cdr) = 0;
};

/// Frames and topics (docs/ros2.md draws them).
struct BridgeOptions {
  std::string name_space = "/vergence";  // of the topics that are not ROS's own
  std::string odom_frame = "odom", base_frame = "base_link", enu_frame = "enu";
  bool camera_child = false;  // the child of odometry is the left camera's optical frame
  bool publish_tf = true;     // odom → child
  bool images = false;        // image_raw of the left and the right camera
  Transform T_base_left{};    // pose of the left camera's optical axes in base_frame
};

/// Makes ROS 2 messages of lines of the pose stream, version 2.
///
/// Threads  Not thread-safe: call from one thread.
/// Errors   A line of another version: InputError. A malformed line is left out and counted.
class Bridge {
 public:
  static constexpr int kVersion = 2;  // of the pose stream

  /// Answer to a request.
  struct Response {
    bool accepted = false;
    std::string message{};
  };

  /// Announces all topics but those of cameras, whose names come with the calibration. `writer`
  /// outlives it.
  Bridge(const BridgeOptions& options, TopicWriter* writer);
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  /// A line without its line feed. Returns the response that it holds.
  std::optional<Response> add(std::string_view line);
  /// The line in front of an image; any other has no effect. Returns the image's size in bytes.
  std::size_t begin_image(std::string_view line);
  /// The pixels that followed. camera_info is published with the image's stamp, so that
  /// stereo_image_proc finds the two together. Without a calibration nothing is published.
  void end_image(std::string_view pixels);
  /// The connection has ended: speeds are not measured across it.
  void disconnected() noexcept { previous_.reset(); }
  /// Publishes diagnostics of level STALE. `message`: why there is no status.
  void publish_stale(Stamp now, const std::string& message);
  /// Lines that were left out, and status lines, since the start.
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }
  [[nodiscard]] std::uint64_t statuses() const noexcept { return statuses_; }

 private:
  using Covariance = Eigen::Matrix<double, 6, 6>;  // translation, rotation

  struct PosedChild {
    Stamp stamp{};
    Transform T_odom_child{};
  };
  struct Alignment {
    Transform T_enu_world{};
    LocalTangentPlane plane{};
    Vec3 position_variance = Vec3::Zero(), rotation_variance = Vec3::Zero();  // m², rad²
  };

  void on_pose(const nlohmann::json& line);
  void on_calibration(const nlohmann::json& line);
  void on_alignment(const nlohmann::json& line);
  void on_status(const nlohmann::json& line);
  void publish_camera_info(std::size_t camera, Stamp stamp);
  [[nodiscard]] std::string camera_topic(std::size_t camera, const char* name) const;
  void measure_twist(const nlohmann::json& line, const PosedChild& now, double widening,
                     OdometryMessage* odometry) const;
  void publish_in_enu(Stamp stamp, const Transform& T_world_left, const Covariance& covariance);
  template <class Write>
  void publish(const std::string& topic, const Write& write);

  const BridgeOptions options_;
  TopicWriter* const writer_;
  // The odometry's frames, and the child as seen from the left camera.
  const Transform T_odom_world_, T_left_child_;
  std::string child_frame_;
  const std::string odometry_topic_, fix_topic_, pose_enu_topic_;

  std::optional<PosedChild> previous_{};
  std::optional<Alignment> alignment_{};
  std::string calibration_text_{}, rating_{};  // the newest line; its rating, empty: none
  RigCalibration rig_{};                       // of the newest line
  std::vector<std::string> names_{};           // of its cameras, as parts of topics and frames
  struct {
    std::size_t camera = 0;
    Stamp stamp{};
    int width = 0, height = 0;
  } image_;  // whose pixels come next
  std::uint64_t malformed_ = 0, statuses_ = 0, dropped_ = 0;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace vergence::app::ros2
