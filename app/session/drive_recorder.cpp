#include "app/session/drive_recorder.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "app/session/recording_plan.hpp"

namespace vergence::app {
namespace {

constexpr Duration kHealth = Duration::seconds(1);

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
      frames_(recorded_names(facts.begin.file)),
      folder_(folder.string()),
      recording_(folder, recording_options(configuration, facts)),
      rig_(facts.begin.file.rig),
      calibrated_(facts.begin.trust != CalibrationTrust::none) {
  for (std::size_t k = 0; k < frames_.size(); ++k) frame_names_[k] = frames_[k];
}

void DriveRecorder::close(std::vector<std::string>* faults) {
  recording_.close();
  if (const std::uint64_t lost = recording_.counters().lost; lost > 0)
    faults->push_back(fmt::format(
        "{}: the recording is not complete ({} messages are lost); check that disk and make room "
        "on it",
        folder_, lost));
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

/// False: dropped.
bool DriveRecorder::post_pixels(const RigFrame& frame, std::size_t camera) noexcept {
  const ImageView& image = frame.images[camera];
  const std::string_view name = frame_names_[camera];
  std::uint32_t& crc = frame_.image_crc[camera];
  bool written = false;
  crc =
      post(image_topic(camera), frame.stamp,
           image_message_size(image.width, image.height, name.size()), true, [&](CdrWriter* out) {
             write_image(out, frame.stamp, name, image);
             written = out->ok();
             return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
           });
  return written;
}

void DriveRecorder::post_image(const RigFrame& frame, std::size_t camera) noexcept {
  if (!post_pixels(frame, camera)) return;
  const std::string_view name = frame_names_[camera];
  frame_.images_recorded = static_cast<std::uint8_t>(frame_.images_recorded | 1U << camera);
  post(image_topic(camera) + 1, frame.stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_camera_info(out, frame.stamp, name, rig_, static_cast<int>(camera), calibrated_);
    return std::size_t{0};
  });
}

void DriveRecorder::post_rig(Stamp stamp) noexcept {
  const auto cameras = static_cast<std::size_t>(rig_.cameras);
  const std::uint64_t files = recording_.counters().files;  // before: it is in that one or a later
  post(tf_static_topic, stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_rig_transforms(out, stamp, rig_, std::span(frame_names_).first(cameras));
    rig_in_file_ = files;
    return std::size_t{0};
  });
}

/// Who opens one file of several has no other. Where only what is around events is kept, each
/// second may be the first that is.
bool DriveRecorder::rig_is_due(bool each_second) const noexcept {
  if (!calibrated_) return false;
  return rig_in_file_ != recording_.counters().files || (each_second && settings_.keep_s > 0);
}

void DriveRecorder::on_pose(const PoseSample& sample) noexcept {
  frame_.sample = sample;
  frame_.solver_done = watch_.found_idle();
  post(frame_topic, sample.stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_frame(out, frame_);
    return std::size_t{0};
  });
  if (settings_.poses == 0) return;
  const bool health = frames_seen_ == 1 || sample.stamp - last_health_ >= kHealth ||
                      sample.status != PoseStatus::ok;
  if (rig_is_due(health)) post_rig(sample.stamp);
  post(odometry_topic, sample.stamp, kMessageRoom, false, [&](CdrWriter* out) {
    write_odometry(out, sample);
    return std::size_t{0};
  });
  if (sample.status != PoseStatus::lost)
    post(tf_topic, sample.stamp, kMessageRoom, false, [&](CdrWriter* out) {
      write_pose_transform(out, sample);
      return std::size_t{0};
    });
  if (health) post_health(sample);
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
  rig_ = calibration.calibration;
  calibrated_ = true;
  if (settings_.poses != 0) post_rig(calibration.stamp);
}

void DriveRecorder::on_pulse(Stamp arrival, const Pulse& pulse, Stamp edge) noexcept {
  post(
      pulse_topic, arrival, kMessageRoom, false,
      [&](CdrWriter* out) {
        write_pulse(out, arrival, pulse, edge);
        return std::size_t{0};
      },
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
