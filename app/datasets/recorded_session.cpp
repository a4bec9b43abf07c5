#include "app/datasets/recorded_session.hpp"

#include "app/datasets/detail/names.hpp"
#include "app/datasets/detail/ros_reader.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/version.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;
using detail::RosReader;

// Maximum size of a message without an image, in bytes.
constexpr std::size_t kMaxSmall = 65536;
// In bytes.
constexpr std::size_t kMaxDescription = std::size_t{4} << 20;
// 37 hours at 30 Hz.
constexpr std::size_t kMaxFrames = 4'000'000;

/// Verifies the checksum at the end of a message.
bool check(std::span<const std::uint8_t> bytes, RosReader* in) {
  const std::size_t end = in->position();
  const auto crc = in->get<std::uint32_t>();
  return in->ok() && crc == crc32_of(bytes.first(end));
}

std::optional<FrameRecord> read_frame(std::span<const std::uint8_t> bytes) {
  RosReader in(bytes, detail::MessageEncoding::cdr);
  (void)in.header();
  FrameRecord f;
  f.number = in.get<std::uint64_t>();
  f.stamp = Stamp(in.get<std::int64_t>());
  f.stamp_error = Duration::nanoseconds(in.get<std::int64_t>());
  f.spread = Duration::nanoseconds(in.get<std::int64_t>());
  f.pairing = in.get<std::uint8_t>();
  f.cameras = in.get<std::uint8_t>();
  f.images_present = in.get<std::uint8_t>();
  f.images_recorded = in.get<std::uint8_t>();
  if (in.get<std::uint32_t>() != f.image_crc.size()) return std::nullopt;
  for (std::uint32_t& crc : f.image_crc) crc = in.get<std::uint32_t>();
  f.recalibration_requested = in.get<std::uint8_t>() != 0;
  f.solver_done = in.get<std::uint8_t>() != 0;
  // State, status and reason are skipped.
  for (int i = 0; i < 3; ++i) (void)in.get<std::uint8_t>();
  // The pose is skipped.
  (void)in.doubles<7>();
  (void)in.get<std::int32_t>();
  (void)in.get<double>();
  (void)in.get<float>();
  FrameWorkload& effort = f.sample.effort;
  effort.points_percent = in.get<std::uint8_t>();
  effort.window_keyframes = in.get<std::uint8_t>();
  effort.window_steps = in.get<std::uint8_t>();
  const bool sound = check(bytes, &in) && effort.points_percent >= 1 &&
                     effort.points_percent <= 100 && f.cameras >= 2 && f.cameras <= kMaxCameras;
  return sound ? std::optional(f) : std::nullopt;
}

std::optional<InsRecord> read_reading(std::span<const std::uint8_t> bytes) {
  RosReader in(bytes, detail::MessageEncoding::cdr);
  (void)in.header();
  InsRecord r;
  InsSample& s = r.sample;
  InsQuality& q = r.quality;
  s.number = in.get<std::uint64_t>();
  s.stamp = Stamp(in.get<std::int64_t>());
  s.stamp_error = Duration::nanoseconds(in.get<std::int64_t>());
  const auto fix = in.get<std::uint8_t>();
  s.attitude_valid = in.get<std::uint8_t>() != 0;
  s.velocity_valid = in.get<std::uint8_t>() != 0;
  s.position = {in.get<double>(), in.get<double>(), in.get<double>()};
  s.velocity_enu = in.doubles<3>();
  s.q_enu_ins = in.doubles<4>();
  for (double* sigma :
       {&s.position_sigma, &s.height_sigma, &s.velocity_sigma, &s.tilt_sigma, &s.heading_sigma})
    *sigma = in.get<double>();
  q.status = in.get<std::uint32_t>();
  q.utc_valid = in.get<std::uint8_t>() != 0;
  q.utc_ns = in.get<std::int64_t>();
  q.satellites = in.get<std::uint8_t>();
  q.position_dop = in.get<float>();
  q.filter_valid = in.get<std::uint8_t>() != 0;
  q.sync_out = in.get<std::uint8_t>() != 0;
  if (!check(bytes, &in) || fix > static_cast<std::uint8_t>(FixStatus::fix_3d)) return std::nullopt;
  s.fix = static_cast<FixStatus>(fix);
  return r;
}

}  // namespace

/// Result of a scan.
struct RecordedSession::Reader {
  RecordedSession* session;
  const fs::path& folder;
  // Camera indices by image topic.
  std::map<std::string, std::size_t> cameras{};
  bool described = false;
  // Newest images that do not belong to a frame yet.
  std::array<RecordedImage, kMaxCameras> newest{};
  std::array<Stamp, kMaxCameras> newest_stamp{};
  std::size_t broken = 0, images_lost = 0;

  void read_message(const detail::BagMessage& m, std::uint32_t file) {
    const std::string& type = m.channel->type;
    if (m.channel->topic == SessionDescription::kTopic) return read_description(m);
    if (type == "sensor_msgs/Image") return add_image(m, file);
    if (type == "vergence_msgs/Frame") return add_frame(m);
    if (type == "vergence_msgs/InsReading") return add_reading(m);
  }

  void read_description(const detail::BagMessage& m) {
    if (described) return;
    const auto bytes = detail::first_bytes(m, kMaxDescription);
    RosReader in(bytes, detail::MessageEncoding::cdr);
    const std::string json = in.text();
    if (!in.ok()) refuse(folder, 0, "has a recording with a damaged description; record it again");
    session->description_ = parse_session_description(json, folder.string());
    const auto& topics = session->description_.cameras;
    if (topics.size() < 2 || topics.size() > kMaxCameras)
      refuse(folder, 0, "has a recording whose description names no cameras; record it again");
    for (std::size_t k = 0; k < topics.size(); ++k) cameras[topics[k]] = k;
    described = true;
  }

  void add_image(const detail::BagMessage& m, std::uint32_t file) {
    const auto camera = cameras.find(m.channel->topic);
    if (camera == cameras.end() || m.place.chunk != detail::BagPlace::kNoChunk) return;
    const auto image = detail::read_ros_image(detail::first_bytes(m, detail::kRosImageHead),
                                              m.place.size, detail::MessageEncoding::cdr, nullptr);
    if (!image || image->bytes == 0 || image->layout != detail::PixelLayout::grey ||
        image->step != static_cast<std::uint32_t>(image->size.width))
      return;
    newest[camera->second] = {file, m.place.offset + image->offset, image->size.width,
                              image->size.height};
    newest_stamp[camera->second] = image->stamp;
  }

  void add_frame(const detail::BagMessage& m) {
    const auto record = read_frame(detail::first_bytes(m, kMaxSmall));
    broken += record ? 0 : 1;
    if (!record) return;
    if (session->frames_.size() == kMaxFrames)
      refuse(folder, 0, "has a recording of more than {} frames", kMaxFrames);
    RecordedFrame frame{*record, {}, session->readings_.size()};
    for (std::size_t k = 0; k < static_cast<std::size_t>(record->cameras); ++k) {
      if ((record->images_present >> k & 1U) == 0) continue;
      if (newest[k].offset != 0 && newest_stamp[k] == record->stamp)
        frame.images[k] = newest[k];
      else
        ++images_lost;
    }
    newest = {};
    session->frames_.push_back(frame);
  }

  void add_reading(const detail::BagMessage& m) {
    const auto reading = read_reading(detail::first_bytes(m, kMaxSmall));
    broken += reading ? 0 : 1;
    if (!reading) return;
    if (session->readings_.size() == kMaxReadings)
      refuse(folder, 0, "has a recording of more than {} INS samples", kMaxReadings);
    session->readings_.push_back(*reading);
  }
};

RecordedSession RecordedSession::open(const fs::path& folder) {
  RecordedSession session;
  session.files_ = detail::open_bag_files(detail::BagFormat::mcap, folder);
  Reader reader{&session, folder};
  for (std::size_t i = 0; i < session.files_.size(); ++i) {
    const detail::BagFile& file = session.files_[i];
    const auto scan =
        detail::scan_bag(detail::BagFormat::mcap, *file.bytes, [&](const detail::BagMessage& m) {
          reader.read_message(m, static_cast<std::uint32_t>(i));
        });
    if (!scan) {
      session.remarks_.push_back(file.name + " is not a recording and is skipped");
      session.complete_ = session.complete_ && i + 1 == session.files_.size();
      continue;
    }
    scan->remark(file.name, &session.remarks_);
    session.complete_ = session.complete_ && !scan->first_broken;
  }
  if (!reader.described)
    refuse(folder, 0,
           "holds no recording of a session: its .mcap files are from another program; use "
           "--format mcap");
  if (session.frames_.empty())
    refuse(folder, 0,
           "has a recording without a complete frame: the run was too short, or the file is "
           "truncated; record again");
  if (std::ranges::none_of(session.frames_, [](const RecordedFrame& f) {
        return std::ranges::any_of(f.images, &RecordedImage::offset);
      }))
    refuse(folder, 0,
           "has a recording without images; record with record: [images] (docs/session_files.md)");
  if (reader.broken > 0)
    session.remarks_.push_back(fmt::format(
        "{} frames or samples of the recording are damaged and are skipped", reader.broken));
  if (reader.images_lost > 0)
    session.remarks_.push_back(
        fmt::format("{} images of the run are missing in the recording", reader.images_lost));
  session.complete_ = session.complete_ && reader.broken == 0 && reader.images_lost == 0;
  if (session.description_.program != version())
    session.remarks_.push_back(
        fmt::format("recorded by version {}, replayed by {}: poses may differ",
                    session.description_.program, version()));
  return session;
}

bool RecordedSession::read(const RecordedFrame& frame, std::size_t camera, std::uint8_t* out,
                           std::size_t stride) const noexcept {
  const RecordedImage& image = frame.images[camera];
  if (image.offset == 0) return false;
  const auto width = static_cast<std::size_t>(image.width);
  const auto size = width * static_cast<std::size_t>(image.height);
  const detail::ByteSource& file = *files_[image.file].bytes;
  // The pixels are read in one piece for the checksum. Then the rows are moved apart, the last one
  // first.
  if (!file.read(image.offset, {out, size})) return false;
  if (crc32_of({out, size}) != frame.given.image_crc[camera]) return false;
  if (stride != width)
    for (std::size_t y = static_cast<std::size_t>(image.height); y-- > 0;)
      std::memmove(out + y * stride, out + y * width, width);
  return true;
}

bool holds_recorded_session(const fs::path& folder) {
  using detail::present;
  return present(folder / "poses.csv") &&
         (present(folder / "drive.mcap") || present(folder / "drive_0.mcap"));
}

}  // namespace vergence::app
