#include "app/session/drive_recorder.hpp"

#include "app/runtime/nearest.hpp"
#include "app/runtime/version.hpp"

namespace vergence::app {

namespace {

/// Topics of a recording. Of a camera there are two, from first_camera_topic on.
enum Topic : std::size_t {
  session_topic,
  frame_topic,
  odometry_topic,
  tf_topic,
  tf_static_topic,
  reading_topic,
  fix_topic,
  imu_topic,
  pulse_topic,
  first_camera_topic
};

/// A camera's images; its CameraInfo is the next one.
constexpr std::size_t image_topic(std::size_t camera) noexcept {
  return first_camera_topic + 2 * camera;
}

/// Names of the cameras in topics and as frames of reference: those of the calibration, each once.
std::vector<std::string> recorded_names(const CalibrationFile& file) {
  return distinct_names({file.names.begin(), file.names.begin() + file.rig.cameras});
}

// Bytes of a queue without images.
constexpr std::size_t kSmall = std::size_t{4} << 20;
// Duration in s of a disk stall that the queues absorb: 1 s more than is permitted.
constexpr double kDiskS = 6;
// Bytes of the queue for pulses.
constexpr std::size_t kPulseQueue = std::size_t{1} << 20;

std::vector<RecordedTopic> topics(const CalibrationFile& file) {
  std::vector<RecordedTopic> out{{SessionDescription::kTopic, RosType::text, true},
                                 {"/vergence/frame", RosType::frame, false},
                                 {"/vergence/odometry", RosType::odometry, false},
                                 {"/tf", RosType::tf, false},
                                 {"/tf_static", RosType::tf, true},
                                 {"/vergence/ins_reading", RosType::ins_reading, false},
                                 {"/ins/fix", RosType::nav_sat_fix, false},
                                 {"/ins/imu", RosType::imu, false},
                                 {"/vergence/pulse", RosType::pulse, false}};
  for (const std::string& name : recorded_names(file)) {
    const std::string images = "/" + name + "/image_raw";
    out.push_back({images, RosType::image, false});
    out.push_back({"/" + name + "/camera_info", RosType::camera_info, false});
  }
  return out;
}

/// As `--set` takes them.
std::vector<std::string> list_settings(const Configuration& c) {
  std::vector<std::string> out;
  for (auto& [key, value] : changed_settings(c)) {
    // Masks are relative to the configuration, and a replay may run in another directory.
    if (key.ends_with(".mask")) value = std::filesystem::absolute(c.folder / value).string();
    out.push_back(key + "=" + value);
  }
  return out;
}

std::vector<std::uint8_t> description(const Configuration& c, const SourceFacts& facts) {
  SessionDescription d{.program = std::string(version()),
                       .calibration = format_calibration(facts.begin.file)};
  CalibrationFile nominal = facts.begin.file;
  nominal.rig = facts.begin.nominal;
  d.nominal = format_calibration(nominal);
  d.trust = facts.begin.trust;
  d.cause = facts.begin.cause;
  d.source = facts.begin.source;
  d.adoption = facts.adoption;
  d.ins = facts.ins.has_value();
  if (facts.ins) d.mount_source = facts.ins->mount_source;
  d.settings = list_settings(c);
  for (std::size_t k = 0; k < static_cast<std::size_t>(facts.begin.file.rig.cameras); ++k)
    d.cameras.push_back(topics(facts.begin.file)[image_topic(k)].name);
  const std::string json = to_json(d);
  std::vector<std::uint8_t> bytes(json.size() + 16);
  CdrWriter out(bytes);
  write_text(&out, json);
  bytes.resize(out.size());
  return bytes;
}

/// Size of all cameras' images of one frame.
double frame_bytes(const SourceFacts& facts) {
  double bytes = 0;
  for (int k = 0; k < facts.begin.file.rig.cameras; ++k) {
    const Intrinsics& lens = facts.begin.file.rig.intrinsics[static_cast<std::size_t>(k)];
    bytes += static_cast<double>(lens.width) * lens.height;
  }
  return bytes;
}

// Number of frames that may be queued before a replay waits for room.
constexpr double kMinHeld = 16;

/// Size of the estimator thread's queue, which holds images while the disk stalls.
std::size_t queue_bytes(const Configuration& c, const SourceFacts& facts) {
  if (c.record.images == 0) return kSmall;
  const double held = facts.when_full == WhenFull::wait ? 0 : kDiskS * c.trigger.rate;
  return kSmall + static_cast<std::size_t>(frame_bytes(facts) * std::max(held, kMinHeld));
}

Recording::Options recording_options(const Configuration& c, const SourceFacts& facts) {
  return {.topics = topics(facts.begin.file),
          .preamble = {{session_topic, description(c, facts)}},
          .roll_bytes = static_cast<std::uint64_t>(c.record.split_mb) * 1'000'000,
          .queues = {queue_bytes(c, facts), kPulseQueue},
          .start = facts.first,
          .when_full = facts.when_full};
}

}  // namespace

DriveRecorder::DriveRecorder(const std::filesystem::path& folder,
                             const Configuration& configuration, const SourceFacts& facts,
                             const ReplayableSolverRunner& watch)
    : settings_(configuration.record),
      watch_(watch),
      frames_(recorded_names(facts.begin.file)),
      folder_(folder.string()),
      recording_(folder, recording_options(configuration, facts)),
      rig_(facts.begin.file.rig),
      calibrated_(facts.begin.trust != CalibrationTrust::none) {}

void DriveRecorder::close(std::vector<std::string>* faults) {
  recording_.close();
  if (const std::uint64_t lost = recording_.counters().lost; lost > 0)
    faults->push_back(
        fmt::format("{}: the recording is not complete ({} messages are lost); check the disk and "
                    "free space on it",
                    folder_, lost));
}

/// True if it is in the queue.
template <class Write>
bool DriveRecorder::post(std::size_t topic, Stamp stamp, const Write& write, std::size_t queue,
                         std::size_t most, bool bulky) noexcept {
  if (stopped_.load(std::memory_order_relaxed)) return false;
  const auto room = recording_.begin(queue, topic, stamp, most, bulky);
  if (room.empty()) return false;
  CdrWriter out(room);
  write(&out);
  if (out.ok()) recording_.commit(queue, out.size());
  return out.ok();
}

void DriveRecorder::on_frame(const RigFrame& frame) noexcept {
  frame_ = {};
  frame_.number = frame.number;
  frame_.stamp = frame.stamp;
  frame_.stamp_error = frame.stamp_error;
  frame_.spread = frame.spread;
  frame_.pairing = static_cast<std::uint8_t>(frame.pairing);
  frame_.cameras = frame.cameras;
  frame_.recalibration_requested = std::exchange(recalibrate_, false);
  for (std::size_t k = 0; k < static_cast<std::size_t>(frame.cameras); ++k) {
    if (frame.images[k].empty()) continue;
    frame_.images_present = static_cast<std::uint8_t>(frame_.images_present | 1U << k);
    if (settings_.images != 0) post_image(frame, k);
  }
}

void DriveRecorder::post_image(const RigFrame& frame, std::size_t camera) noexcept {
  const ImageView& image = frame.images[camera];
  const std::string& name = frames_[camera];
  const auto write = [&](CdrWriter* out) {
    write_image(out, frame.stamp, name, image);
    const auto pixels =
        static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    if (out->ok()) frame_.image_crc[camera] = crc32_of(out->written().last(pixels));
  };
  if (!post(image_topic(camera), frame.stamp, write, estimator_queue,
            image_message_size(image.width, image.height, name.size()), true))
    return;
  frame_.images_recorded = static_cast<std::uint8_t>(frame_.images_recorded | 1U << camera);
  post(image_topic(camera) + 1, frame.stamp, [&](CdrWriter* out) {
    write_camera_info(out, frame.stamp, name, rig_, static_cast<int>(camera), calibrated_);
  });
}

void DriveRecorder::post_rig(Stamp stamp) noexcept {
  // Read before the message is posted, which then is in this file or a later one.
  const std::uint64_t files = recording_.counters().files;
  post(tf_static_topic, stamp, [&](CdrWriter* out) {
    write_rig_transforms(out, stamp, rig_, frames_);
    rig_in_file_ = files;
  });
}

void DriveRecorder::on_pose(const FrameReport& report) noexcept {
  const PoseSample& sample = report.pose;
  frame_.sample = sample;
  frame_.solver_done = watch_.found_idle();
  post(frame_topic, sample.stamp, [&](CdrWriter* out) { write_frame(out, frame_); });
  if (settings_.poses == 0) return;
  if (rig_is_due()) post_rig(sample.stamp);
  post(odometry_topic, sample.stamp, [&](CdrWriter* out) { write_odometry(out, sample); });
  if (sample.status != PoseStatus::lost)
    post(tf_topic, sample.stamp, [&](CdrWriter* out) { write_pose_transform(out, sample); });
}

void DriveRecorder::on_reading(const InsRecord& reading) noexcept {
  if (settings_.ins == 0) return;
  const Stamp stamp = reading.sample.stamp;
  post(reading_topic, stamp,
       [&](CdrWriter* out) { write_ins_reading(out, reading.sample, reading.quality); });
  post(fix_topic, stamp, [&](CdrWriter* out) { write_nav_sat_fix(out, reading.sample); });
  post(imu_topic, stamp, [&](CdrWriter* out) { write_imu(out, reading.sample); });
}

void DriveRecorder::on_event(const EventRecord& event) noexcept {
  const std::string_view kind = event.kind, message = event.message.data();
  recalibrate_ = recalibrate_ || kind == "recalibration_requested" ||
                 (kind == "fault" && message.starts_with("recalibrate"));
}

void DriveRecorder::on_calibration(const CalibrationRecord& calibration) noexcept {
  if (!calibration.decided || !calibration.accepted) return;
  rig_ = calibration.calibration;
  calibrated_ = true;
  if (settings_.poses != 0) post_rig(calibration.stamp);
}

void DriveRecorder::on_pulse(Stamp arrival, const Pulse& pulse, Stamp edge) noexcept {
  post(
      pulse_topic, arrival, [&](CdrWriter* out) { write_pulse(out, arrival, pulse, edge); },
      acquisition_queue);
}

std::vector<std::pair<std::string, std::uint64_t>> DriveRecorder::counters() {
  const RecordingCounters c = recording_.counters();
  return {
      {"recorded_messages", c.messages}, {"recorded_bytes", c.bytes},
      {"recording_dropped", c.dropped},  {"recording_dropped_images", c.dropped_images},
      {"recording_lost", c.lost},        {"recording_queue_high_water_bytes", c.queue_high_water}};
}

}  // namespace vergence::app
