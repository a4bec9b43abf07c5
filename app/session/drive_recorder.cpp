#include "app/session/drive_recorder.hpp"

#include <algorithm>
#include <string_view>

#include "app/config/schema.hpp"
#include "app/recording/session_description.hpp"
#include "app/runtime/version.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kSmall = std::size_t{4} << 20;  // bytes of a queue without images
constexpr double kDiskS = 6;  // s of a disk that stalls: one second more than it may take
constexpr Duration kHealth = Duration::seconds(1);

/// Queues of a recording, one for each thread that posts.
enum Queue : std::size_t { estimator_queue, acquisition_queue, ins_queue, board_queue };
constexpr std::size_t kDeviceQueue = std::size_t{1} << 20;  // bytes

/// Topics of a recording. Of a camera there are three, from first_camera_topic on.
enum Topic : std::size_t {
  session_topic,
  frame_topic,
  odometry_topic,
  tf_topic,
  tf_static_topic,
  diagnostics_topic,
  reading_topic,
  fix_topic,
  imu_topic,
  pulse_topic,
  ins_raw_topic,
  board_raw_topic,
  first_camera_topic
};

std::size_t image_topic(std::size_t camera) { return first_camera_topic + 3 * camera; }

std::vector<RecordedTopic> topics(const CalibrationFile& file) {
  std::vector<RecordedTopic> out{{SessionDescription::kTopic, RosType::text, true},
                                 {"/vergence/frame", RosType::frame, false},
                                 {"/vergence/odometry", RosType::odometry, false},
                                 {"/tf", RosType::tf, false},
                                 {"/tf_static", RosType::tf, true},
                                 {"/diagnostics", RosType::diagnostics, false},
                                 {"/vergence/ins_reading", RosType::ins_reading, false},
                                 {"/ins/fix", RosType::nav_sat_fix, false},
                                 {"/ins/imu", RosType::imu, false},
                                 {"/vergence/pulse", RosType::pulse, false},
                                 {"/ins/raw", RosType::bytes, false},
                                 {"/trigger_board/raw", RosType::bytes, false}};
  for (std::size_t k = 0; k < static_cast<std::size_t>(file.rig.cameras); ++k) {
    out.push_back({"/" + file.names[k] + "/image_raw", RosType::image, false});
    out.push_back({"/" + file.names[k] + "/camera_info", RosType::camera_info, false});
    out.push_back({"/" + file.names[k] + "/device_frame", RosType::device_frame, false});
  }
  return out;
}

/// Keys that are not as they are when nobody says anything.
std::vector<std::string> settings_of(const Configuration& c) {
  const Configuration defaults;
  std::vector<std::string> out;
  for (const Group& group : schema())
    for (const Key& key : group.keys)
      if (std::string value = to_text(key.get(c)); value != to_text(key.get(defaults))) {
        if (key.name.ends_with(".mask"))  // beside the configuration, wherever the replay runs
          value = std::filesystem::absolute(c.folder / value).string();
        out.push_back(key.name + "=" + value);
      }
  return out;
}

std::vector<std::uint8_t> description(const Configuration& c, const SourceFacts& facts) {
  SessionDescription d;
  d.program = version();
  d.calibration = format_calibration(facts.begin.file);
  CalibrationFile nominal = facts.begin.file;
  nominal.rig = facts.begin.nominal;
  d.nominal = format_calibration(nominal);
  d.trust = facts.begin.trust;
  d.cause = facts.begin.cause;
  d.source = facts.begin.source;
  d.adoption = facts.adoption;
  d.ins = facts.ins.has_value();
  if (facts.ins) d.mount_source = facts.ins->mount_source;
  d.settings = settings_of(c);
  for (std::size_t k = 0; k < static_cast<std::size_t>(facts.begin.file.rig.cameras); ++k)
    d.cameras.push_back(topics(facts.begin.file)[image_topic(k)].name);
  const std::string json = to_json(d);
  std::vector<std::uint8_t> bytes(json.size() + 16);
  CdrWriter out(bytes);
  write_text(&out, json);
  bytes.resize(out.size());
  return bytes;
}

/// Bytes of images a second, and how many seconds of them are held.
std::size_t queue_bytes(const Configuration& c, const SourceFacts& facts) {
  if (c.record.memory_mb > 0) return static_cast<std::size_t>(c.record.memory_mb) << 20U;
  if (c.record.images == 0) return kSmall;
  double bytes = 0;
  for (int k = 0; k < facts.begin.file.rig.cameras; ++k) {
    const Intrinsics& lens = facts.begin.file.rig.intrinsics[static_cast<std::size_t>(k)];
    bytes += static_cast<double>(lens.width) * lens.height;
  }
  // A replay waits for room: it needs that of a few frames.
  const double held = facts.when_full == Recorder::WhenFull::wait
                          ? 16.0
                          : (kDiskS + c.record.keep_s) * c.trigger.rate;
  return kSmall + static_cast<std::size_t>(bytes * std::max(held, 16.0));
}

Recording::Options options(const Configuration& c, const SourceFacts& facts) {
  Recording::Options o;
  o.topics = topics(facts.begin.file);
  o.queues = {queue_bytes(c, facts), kDeviceQueue, kDeviceQueue, kDeviceQueue};
  o.preamble = {{session_topic, description(c, facts)}};
  o.start = facts.first;
  o.roll_bytes = static_cast<std::uint64_t>(c.record.roll_mb) * 1'000'000;
  o.roll_time = Duration::seconds(c.record.roll_s);
  o.keep = Duration::seconds(c.record.keep_s);
  o.when_full = facts.when_full == Recorder::WhenFull::wait ? Recording::WhenFull::wait
                                                            : Recording::WhenFull::drop;
  return o;
}

DiagnosticLevel level_of(PoseStatus status) {
  return status == PoseStatus::ok         ? DiagnosticLevel::ok
         : status == PoseStatus::degraded ? DiagnosticLevel::warn
                                          : DiagnosticLevel::error;
}

}  // namespace

DriveRecorder::DriveRecorder(const std::filesystem::path& folder,
                             const Configuration& configuration, const SourceFacts& facts,
                             const SolverWatch& watch)
    : settings_(configuration.record),
      watch_(watch),
      frames_(facts.begin.file.names),
      recording_(folder, options(configuration, facts)),
      rig_(facts.begin.file.rig),
      calibrated_(facts.begin.trust != CalibrationTrust::none) {
  for (std::size_t k = 0; k < frames_.size(); ++k) frame_names_[k] = frames_[k];
}

/// → CRC-32 of what `write` returns, the bytes of its pixels; 0: dropped.
template <class Write>
std::uint32_t DriveRecorder::post(std::size_t topic, Stamp stamp, std::size_t most, bool bulky,
                                  const Write& write, std::size_t queue) noexcept {
  if (stopped_.load(std::memory_order_relaxed)) return 0;
  const auto room = recording_.begin(queue, topic, stamp, most, bulky);
  if (room.empty()) return 0;
  CdrWriter out(room);
  const std::size_t pixels = write(&out);
  if (!out.ok()) return 0;
  const std::uint32_t crc = pixels > 0 ? crc32_of(out.written().last(pixels)) : 0;
  recording_.commit(queue, out.size());
  return crc;
}

void DriveRecorder::on_frame(const RigFrame& frame) noexcept {
  ++frames_seen_;
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
  const std::string_view name = frame_names_[camera];
  bool written = false;
  const std::uint32_t crc =
      post(image_topic(camera), frame.stamp,
           image_message_size(image.width, image.height, name.size()), true, [&](CdrWriter* out) {
             write_image(out, frame.stamp, name, image);
             written = out->ok();
             return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
           });
  if (!written) return;
  frame_.images_recorded = static_cast<std::uint8_t>(frame_.images_recorded | 1U << camera);
  frame_.image_crc[camera] = crc;
  post(image_topic(camera) + 1, frame.stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_camera_info(out, frame.stamp, name, rig_, static_cast<int>(camera), calibrated_);
    return std::size_t{0};
  });
}

void DriveRecorder::post_rig(Stamp stamp) noexcept {
  const auto cameras = static_cast<std::size_t>(rig_.cameras);
  post(tf_static_topic, stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_rig_transforms(out, stamp, rig_, std::span(frame_names_).first(cameras));
    return std::size_t{0};
  });
  rig_posted_ = true;
}

void DriveRecorder::on_pose(const PoseSample& sample) noexcept {
  frame_.sample = sample;
  frame_.solver_done = watch_.found_idle();
  post(frame_topic, sample.stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_frame(out, frame_);
    return std::size_t{0};
  });
  if (settings_.poses == 0) return;
  if (calibrated_ && !rig_posted_) post_rig(sample.stamp);
  post(odometry_topic, sample.stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_odometry(out, sample);
    return std::size_t{0};
  });
  if (sample.status != PoseStatus::lost)
    post(tf_topic, sample.stamp, kMessageRoom, false, [&](CdrWriter* out) {
      write_pose_transform(out, sample);
      return std::size_t{0};
    });
  if (frames_seen_ == 1 || sample.stamp - last_health_ >= kHealth ||
      sample.status != PoseStatus::ok)
    post_health(sample);
}

/// Once a second, and with every pose that is not ok.
void DriveRecorder::post_health(const PoseSample& sample) noexcept {
  last_health_ = sample.stamp;
  const RecordingCounters c = recording_.counters();
  const auto number = [](std::uint64_t v) { return static_cast<std::int64_t>(v); };
  const std::array pose{
      DiagnosticValue{"frame", number(sample.frame)}, DiagnosticValue{"inliers", sample.inliers},
      DiagnosticValue{"stereo_inliers", sample.stereo_inliers},
      DiagnosticValue{"estimate_us", static_cast<std::int64_t>(1000 * sample.estimate_ms)}};
  const std::array clocks{DiagnosticValue{"stamp_error_ns", frame_.stamp_error.ns()},
                          DiagnosticValue{"spread_ns", frame_.spread.ns()},
                          DiagnosticValue{"pairing", frame_.pairing}};
  const std::array drops{DiagnosticValue{"dropped_messages", number(c.dropped)},
                         DiagnosticValue{"dropped_images", number(c.dropped_images)},
                         DiagnosticValue{"lost_messages", number(c.lost)},
                         DiagnosticValue{"queue_high_water_bytes", number(c.queue_high_water)}};
  const bool lossless = c.dropped + c.lost == 0;
  const std::array status{
      Diagnostic{level_of(sample.status), "vergence: pose", to_string(sample.reason), pose},
      Diagnostic{DiagnosticLevel::ok, "vergence: clocks", "", clocks},
      Diagnostic{lossless ? DiagnosticLevel::ok : DiagnosticLevel::warn, "vergence: recording",
                 lossless ? "" : "not all is recorded", drops}};
  post(diagnostics_topic, sample.stamp, 2 * kMessageRoom, false, [&](CdrWriter* out) {
    write_diagnostics(out, sample.stamp, status);
    return std::size_t{0};
  });
}

void DriveRecorder::on_reading(const InsRecord& reading) noexcept {
  if (settings_.ins == 0) return;
  const Stamp stamp = reading.sample.stamp;
  post(reading_topic, stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_ins_reading(out, reading.sample, reading.quality);
    return std::size_t{0};
  });
  post(fix_topic, stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_nav_sat_fix(out, reading.sample);
    return std::size_t{0};
  });
  post(imu_topic, stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_imu(out, reading.sample);
    return std::size_t{0};
  });
}

void DriveRecorder::on_event(const EventRecord& event) noexcept {
  const std::string_view kind = event.kind, sentence = event.sentence.data();
  recalibrate_ = recalibrate_ || kind == "recalibration_requested" ||
                 (kind == "fault" && sentence.starts_with("recalibrate"));
  if (frames_seen_ > 0) recording_.mark_event(event.stamp);  // before it is set-up
  if (settings_.poses == 0) return;
  const std::array status{Diagnostic{DiagnosticLevel::ok, kind, sentence, {}}};
  post(diagnostics_topic, event.stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_diagnostics(out, event.stamp, status);
    return std::size_t{0};
  });
}

void DriveRecorder::on_calibration(const CalibrationRecord& calibration) noexcept {
  if (!calibration.decided || !calibration.accepted) return;
  rig_ = calibration.rig.rig();
  calibrated_ = true;
  if (settings_.poses != 0) post_rig(calibration.stamp);
}

void DriveRecorder::on_device_frame(Stamp arrival, int camera, const Frame& frame) noexcept {
  if (settings_.pulses == 0) return;
  const auto k = static_cast<std::size_t>(camera);
  post(
      image_topic(k) + 2, arrival, kMessageRoom, false,
      [&](CdrWriter* out) {
        write_device_frame(out, arrival, frame_names_[k], frame);
        return std::size_t{0};
      },
      acquisition_queue);
}

void DriveRecorder::on_pulse(Stamp arrival, const Pulse& pulse) noexcept {
  if (settings_.pulses == 0) return;
  post(
      pulse_topic, arrival, kMessageRoom, false,
      [&](CdrWriter* out) {
        write_pulse(out, arrival, pulse);
        return std::size_t{0};
      },
      acquisition_queue);
}

void DriveRecorder::post_bytes(std::size_t topic, Stamp stamp, std::span<const std::uint8_t> bytes,
                               std::size_t queue) noexcept {
  if (settings_.raw == 0) return;
  post(
      topic, stamp, kMessageRoom + bytes.size(), false,
      [&](CdrWriter* out) {
        write_bytes(out, bytes);
        return std::size_t{0};
      },
      queue);
}

void DriveRecorder::on_ins_bytes(Stamp arrival, std::span<const std::uint8_t> bytes) noexcept {
  post_bytes(ins_raw_topic, arrival, bytes, ins_queue);
}

void DriveRecorder::on_board_bytes(Stamp arrival, std::span<const std::uint8_t> bytes) noexcept {
  post_bytes(board_raw_topic, arrival, bytes, board_queue);
}

std::vector<std::pair<std::string, std::uint64_t>> DriveRecorder::counters() {
  const RecordingCounters c = recording_.counters();
  return {
      {"recorded_messages", c.messages}, {"recorded_bytes", c.bytes},
      {"recording_dropped", c.dropped},  {"recording_dropped_images", c.dropped_images},
      {"recording_lost", c.lost},        {"recording_queue_high_water_bytes", c.queue_high_water}};
}

}  // namespace vergence::app
