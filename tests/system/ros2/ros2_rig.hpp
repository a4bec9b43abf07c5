#pragma once
#include <dds/dds.h>
#include <gtest/gtest.h>
#include <messages.h>

#include <cstdlib>
#include <functional>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "app/publish/line_publisher.hpp"
#include "core/math/random.hpp"
#include "tests/support/child_program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::test {

using namespace std::chrono_literals;

/// Humble's layout under the same name.
inline const dds_topic_descriptor_t kHumbleNodes = [] {
  dds_topic_descriptor_t d = humble_msg_dds__ParticipantEntitiesInfo__desc;
  d.m_typename = rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc.m_typename;
  return d;
}();

/// A message that Cyclone DDS decodes, and its descriptor.
template <class Decoded, const dds_topic_descriptor_t* kOfType>
struct RosKind {
  using Message = Decoded;
  static constexpr const dds_topic_descriptor_t* kDescriptor = kOfType;
};
using RosOdometry = RosKind<nav_msgs_msg_dds__Odometry_, &nav_msgs_msg_dds__Odometry__desc>;
using RosTf = RosKind<tf2_msgs_msg_dds__TFMessage_, &tf2_msgs_msg_dds__TFMessage__desc>;
using RosCameraInfo =
    RosKind<sensor_msgs_msg_dds__CameraInfo_, &sensor_msgs_msg_dds__CameraInfo__desc>;
using RosFix = RosKind<sensor_msgs_msg_dds__NavSatFix_, &sensor_msgs_msg_dds__NavSatFix__desc>;
using RosPose = RosKind<geometry_msgs_msg_dds__PoseWithCovarianceStamped_,
                        &geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc>;
using RosDiagnostics = RosKind<diagnostic_msgs_msg_dds__DiagnosticArray_,
                               &diagnostic_msgs_msg_dds__DiagnosticArray__desc>;
using RosImage = RosKind<sensor_msgs_msg_dds__Image_, &sensor_msgs_msg_dds__Image__desc>;
using RosNodes = RosKind<rmw_dds_common_msg_dds__ParticipantEntitiesInfo_,
                         &rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc>;
using TriggerRequest =
    RosKind<std_srvs_srv_dds__Trigger_Request_, &std_srvs_srv_dds__Trigger_Request__desc>;
using TriggerResponse =
    RosKind<std_srvs_srv_dds__Trigger_Response_, &std_srvs_srv_dds__Trigger_Response__desc>;
using HumbleNodes = RosKind<humble_msg_dds__ParticipantEntitiesInfo_, &kHumbleNodes>;

/// A domain of this process's own, so that tests may run in parallel.
inline std::uint32_t own_domain() { return 1 + static_cast<std::uint32_t>(::getpid()) % 200; }

/// A participant of Cyclone DDS on this machine alone.
class RosParticipant {
 public:
  explicit RosParticipant(std::uint32_t domain) {
    ::setenv("CYCLONEDDS_URI",
             "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" "
             "multicast=\"true\"/></Interfaces></General></Domain></CycloneDDS>",
             1);
    participant_ = dds_create_participant(domain, nullptr, nullptr);
  }
  ~RosParticipant() { (void)dds_delete(participant_); }
  RosParticipant(const RosParticipant&) = delete;
  RosParticipant& operator=(const RosParticipant&) = delete;

  [[nodiscard]] dds_entity_t get() const { return participant_; }

  struct QosDelete {
    void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
  };
  [[nodiscard]] static std::unique_ptr<dds_qos_t, QosDelete> reliable(bool latched) {
    std::unique_ptr<dds_qos_t, QosDelete> qos(dds_create_qos());
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_durability(qos.get(),
                        latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 10);
    return qos;
  }
  template <class Kind>
  [[nodiscard]] dds_entity_t topic(const std::string& name) const {
    return dds_create_topic(participant_, Kind::kDescriptor, name.c_str(), nullptr, nullptr);
  }

 private:
  dds_entity_t participant_ = 0;
};

/// A subscription as ROS 2 has it by default: reliable, the last ten.
template <class Kind>
class RosReader {
 public:
  using Message = typename Kind::Message;
  RosReader(const RosParticipant& participant, const std::string& topic, bool latched = false)
      : RosReader(participant, participant.topic<Kind>("rt" + topic), latched) {}
  RosReader(const RosParticipant& participant, dds_entity_t topic, bool latched = false)
      : reader_(dds_create_reader(participant.get(), topic, RosParticipant::reliable(latched).get(),
                                  nullptr)) {}

  /// The next message if there is one; valid until the next call.
  [[nodiscard]] const Message* read() {
    release();
    dds_sample_info_t info;
    if (dds_take(reader_, &sample_, &info, 1, 1) == 1 && info.valid_data)
      return static_cast<const Message*>(sample_);
    return nullptr;
  }
  /// Waits for it; null: none came in time.
  [[nodiscard]] const Message* next(std::chrono::milliseconds limit = 10s) {
    for (const auto end = std::chrono::steady_clock::now() + limit;
         std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(500us))
      if (const Message* message = read()) return message;
    return nullptr;
  }
  /// GUIDs of the writers that it is matched with.
  [[nodiscard]] std::vector<std::string> writer_guids() const {
    std::vector<std::string> out;
    for_each_writer([&out](const dds_builtintopic_endpoint_t& writer) {
      out.emplace_back(reinterpret_cast<const char*>(writer.key.v), sizeof writer.key.v);
    });
    return out;
  }
  /// USER_DATA of the writers that it is matched with.
  [[nodiscard]] std::vector<std::string> user_data() const {
    std::vector<std::string> out;
    for_each_writer([&out](const dds_builtintopic_endpoint_t& writer) {
      void* bytes = nullptr;
      std::size_t size = 0;
      if (dds_qget_userdata(writer.qos, &bytes, &size) && bytes != nullptr)
        out.emplace_back(static_cast<const char*>(bytes), size);
      dds_free(bytes);
    });
    return out;
  }
  [[nodiscard]] dds_entity_t get() const { return reader_; }
  ~RosReader() {
    release();
    (void)dds_delete(reader_);
  }
  RosReader(const RosReader&) = delete;
  RosReader& operator=(const RosReader&) = delete;

 private:
  template <class Each>
  void for_each_writer(const Each& each) const {
    std::array<dds_instance_handle_t, 8> writers{};
    const auto n = dds_get_matched_publications(reader_, writers.data(), writers.size());
    for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(n, 0)); ++i)
      if (auto* writer = dds_get_matched_publication_data(reader_, writers[i])) {
        each(*writer);
        dds_builtintopic_free_endpoint(writer);
      }
  }
  void release() {
    if (sample_ != nullptr) (void)dds_return_loan(reader_, &sample_, 1);
    sample_ = nullptr;
  }
  dds_entity_t reader_;
  void* sample_ = nullptr;
};

/// The pose stream of a session: the product's publisher, fed by the test.
class StreamSession {
 public:
  explicit StreamSession(const std::string& socket)
      : publisher_(app::make_line_publisher(
            app::open_line_socket({app::LineAddress::Kind::unix_socket, socket, {}}, "test"),
            &requests, {})) {
    publisher_->on_start({.name = "session",
                          .camera_names = {"left", "right"},
                          .image_bytes = kWidth * kHeight,
                          .can_recalibrate = true});
  }

  void calibrate(double fx) {
    app::CalibrationRecord record;
    record.accepted = record.verified = true;
    record.stamp = Stamp(kFirst);
    record.calibration.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k)
      record.calibration.intrinsics[k] = {
          CameraModelKind::pinhole_radtan, 640, 480, fx, fx + 1, 322, 239,
          {-0.3, 0.1, 1e-4, -2e-4, 0.01},  {},  {}};
    record.calibration.T_camera_left[1].t = {-0.75, 0, 0};
    publisher_->on_calibration(record);
  }
  void align() {
    EnuAlignment alignment;
    alignment.T_enu_world.R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    alignment.T_enu_world.t = {1, 2, 3};
    alignment.position_sigma = {0.5, 0.5, 1};
    publisher_->on_enu_alignment(alignment, {-27.4975, 153.0137, 60});
  }
  /// The pose of a camera that looks and drives straight ahead at 0.1 m per frame.
  void pose() {
    RigFrame frame{.number = frames_, .cameras = 2};
    frame.stamp = Stamp(kFirst + static_cast<std::int64_t>(frames_) * kInterval);
    for (std::size_t k = 0; k < 2; ++k) frame.images[k] = image(frames_, k);
    publisher_->on_frame(frame);
    app::FrameReport report;
    PoseSample& sample = report.pose;
    sample.frame = frames_;
    sample.stamp = frame.stamp;
    sample.state = State::stereo_odometry;
    sample.status = PoseStatus::ok;
    sample.T_world_left.t.z() = 0.1 * static_cast<double>(frames_);
    sample.covariance[0] = 0.25F;
    ++frames_;
    publisher_->on_pose(report);
  }
  [[nodiscard]] std::map<std::string, std::uint64_t> counters() {
    std::map<std::string, std::uint64_t> out;
    for (const auto& [name, value] : publisher_->counters()) out[name] = value;
    return out;
  }

  /// Rows, padded by a byte, of one larger random image.
  [[nodiscard]] static ImageView image(std::uint64_t frame, std::size_t camera) {
    static const std::vector<std::uint8_t> pixels = [] {
      std::vector<std::uint8_t> out((kWidth + 1) * kHeight + kShifts);
      Random random(3);
      for (std::uint8_t& pixel : out) pixel = static_cast<std::uint8_t>(random.uniform() * 256);
      return out;
    }();
    const std::size_t shift = (7 * static_cast<std::size_t>(frame) + 3 * camera) % kShifts;
    return {pixels.data() + shift, kWidth, kHeight, kWidth + 1};
  }
  static constexpr int kWidth = 640, kHeight = 480;
  static constexpr std::size_t kShifts = 997;

  /// First stamp in ns.
  static constexpr std::int64_t kFirst = 1'577'836'800'000'000'001;
  /// Frame interval in ns.
  static constexpr std::int64_t kInterval = 50'000'000;
  app::SessionRequests requests;

 private:
  std::unique_ptr<app::SessionObserver> publisher_;
  std::uint64_t frames_ = 0;
};

/// The number of a frame by its stamp.
inline std::int64_t frame_of(const std_msgs_msg_dds__Header_& header) {
  const std::int64_t ns =
      std::int64_t{header.stamp.sec} * 1'000'000'000 + std::int64_t{header.stamp.nanosec};
  return (ns - StreamSession::kFirst) / StreamSession::kInterval;
}

/// vergence-ros2, on this machine alone.
inline std::unique_ptr<ChildProgram> start_bridge(const std::string& socket, std::uint32_t domain,
                                                  std::vector<std::string> more = {},
                                                  const ChildProgram::Start& start = {}) {
  ::setenv("ROS_LOCALHOST_ONLY", "1", 1);
  std::vector<std::string> words{"--socket", "unix://" + socket, "--domain",
                                 fmt::format("{}", domain)};
  words.insert(words.end(), more.begin(), more.end());
  return std::make_unique<ChildProgram>(words, start);
}

/// A socket and a domain for one test.
class Ros2Rig : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::string socket_ = (folder_.path() / "pose.sock").string();
  std::uint32_t domain_ = own_domain();
};

/// Feeds poses until `done` returns true; returns false on a time-out.
inline bool feed_until(StreamSession* session, const std::function<bool()>& done,
                       std::chrono::milliseconds limit = 15s) {
  for (const auto end = std::chrono::steady_clock::now() + limit;
       std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(10ms)) {
    session->pose();
    if (done()) return true;
  }
  return false;
}

}  // namespace vergence::test
