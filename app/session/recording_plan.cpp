#include "app/session/recording_plan.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "app/config/calibration_file.hpp"
#include "app/config/schema.hpp"
#include "app/recording/messages.hpp"
#include "app/recording/session_description.hpp"
#include "app/runtime/distinct_names.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/version.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kSmall = std::size_t{4} << 20;  // bytes of a queue without images
constexpr double kDiskS = 6;  // s of a disk that stalls: one second more than it may take
constexpr std::size_t kPulseQueue = std::size_t{1} << 20;  // bytes
// Bytes that are recorded of each, and some to spare: of a frame beside its images (1310), of a
// reading of the INS (740), of a pulse (300).
constexpr double kFrameRecords = 2048, kReadingRecords = 1024, kPulseRecords = 512;

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
                                 {"/vergence/pulse", RosType::pulse, false}};
  for (const std::string& name : recorded_names(file)) {
    const std::string images = "/" + name + "/image_raw";
    out.push_back({images, RosType::image, false});
    out.push_back({"/" + name + "/camera_info", RosType::camera_info, false});
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

/// Of all cameras' images of one frame.
double frame_bytes(const SourceFacts& facts) {
  double bytes = 0;
  for (int k = 0; k < facts.begin.file.rig.cameras; ++k) {
    const Intrinsics& lens = facts.begin.file.rig.intrinsics[static_cast<std::size_t>(k)];
    bytes += static_cast<double>(lens.width) * lens.height;
  }
  return bytes;
}

/// What an event would keep of records that small.
double kept_bytes(const Configuration& c, double record_bytes, double rate) {
  return c.record.keep_s * rate * record_bytes;
}

/// Of the estimator's thread without images: of frames, and of the INS as it was compared.
double small_bytes(const Configuration& c) {
  return kSmall + kept_bytes(c, kFrameRecords, c.trigger.rate) +
         kept_bytes(c, kReadingRecords, c.ins.rate);
}

constexpr double kLeastHeld = 16;  // frames that wait: a replay waits for room

/// What an address of this machine reaches; a 32-bit one's program has 3 GB for all.
constexpr double kMostQueue = sizeof(void*) > 4 ? 1e15 : 2e9;  // bytes

/// Bytes of images a second, and how many seconds of them are held.
double wanted_queue_bytes(const Configuration& c, const SourceFacts& facts) {
  if (c.record.images == 0) return small_bytes(c);
  const double held = facts.when_full == Recorder::WhenFull::wait
                          ? kLeastHeld
                          : (kDiskS + c.record.keep_s) * c.trigger.rate;
  return small_bytes(c) + frame_bytes(facts) * std::max(held, kLeastHeld);
}

std::size_t queue_bytes(const Configuration& c, const SourceFacts& facts) {
  const double bytes = wanted_queue_bytes(c, facts);
  if (bytes > kMostQueue)
    throw InputError(
        fmt::format("record.keep_s: {:.0f} MB of images are to wait, more than this machine "
                    "can address",
                    bytes / 1e6));
  return static_cast<std::size_t>(bytes);
}

Recording::WhenFull when_full(const SourceFacts& facts) {
  return facts.when_full == Recorder::WhenFull::wait ? Recording::WhenFull::wait
                                                     : Recording::WhenFull::drop;
}

}  // namespace

std::vector<std::string> recorded_names(const CalibrationFile& file) {
  return distinct_names({file.names.begin(), file.names.begin() + file.rig.cameras});
}

Recording::Options recording_options(const Configuration& c, const SourceFacts& facts) {
  Recording::Options o;
  o.files.topics = topics(facts.begin.file);
  o.queues = {queue_bytes(c, facts),
              kPulseQueue + static_cast<std::size_t>(kept_bytes(c, kPulseRecords, c.trigger.rate))};
  o.files.preamble = {{session_topic, description(c, facts)}};
  o.start = facts.first;
  o.files.roll_bytes = static_cast<std::uint64_t>(c.record.roll_mb) * 1'000'000;
  o.keep = Duration::seconds(c.record.keep_s);
  o.when_full = when_full(facts);
  return o;
}

}  // namespace vergence::app
