#include "app/datasets/device_recording.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/detail/ros_reader.hpp"
#include "app/datasets/text_file.hpp"
#include "app/recording/session_description.hpp"

namespace vergence::app {
namespace {

using detail::RosReader;

constexpr std::size_t kMostMessage = 131'072;                  // bytes: a set-up is 65536 at most
constexpr std::size_t kMostItems = 20'000'000;                 // of a kind
constexpr std::size_t kMostLineBytes = std::size_t{1} << 30U;  // of a line: 26 hours at 115200 baud

HostStamp host(RosReader* in) { return HostStamp(in->get<std::int64_t>()); }
Duration duration(RosReader* in) { return Duration::nanoseconds(in->get<std::int64_t>()); }

std::optional<Frame> read_device_frame(RosReader in) {
  Frame f;
  f.arrival = host_of(in.header());  // arrival_host_ns is of a clock that nobody has any more
  f.counter = in.get<std::uint64_t>();
  f.exposure_start = DeviceStamp(in.get<std::int64_t>());
  (void)in.get<std::int64_t>();
  f.exposure = duration(&in);
  f.gain_db = in.get<double>();
  f.status = in.get<std::uint8_t>() != 0 ? FrameStatus::complete : FrameStatus::torn;
  return in.ok() ? std::optional(f) : std::nullopt;
}

/// Sequences of the cameras' times.
bool read_exposures(RosReader* in, std::uint8_t seen, Pulse* pulse) {
  for (Duration PulseExposure::*member : {&PulseExposure::start, &PulseExposure::end}) {
    if (in->get<std::uint32_t>() != pulse->exposure.size()) return false;
    for (std::size_t k = 0; k < pulse->exposure.size(); ++k) {
      pulse->exposure[k].*member = duration(in);
      pulse->exposure[k].seen = (seen >> k & 1U) != 0;
    }
  }
  return in->ok();
}

std::optional<Pulse> read_pulse(RosReader in) {
  Pulse p;
  p.arrival = host_of(in.header());
  p.number = in.get<std::uint64_t>();
  p.boot = in.get<std::uint32_t>();
  p.edge = DeviceStamp(in.get<std::int64_t>());
  (void)in.get<std::int64_t>();
  p.resumed = in.get<std::uint8_t>() != 0;
  const auto seen = in.get<std::uint8_t>();
  if (!read_exposures(&in, seen, &p)) return std::nullopt;
  p.mapped = in.get<std::uint8_t>() != 0;
  p.host = host(&in);
  p.host_error = duration(&in);
  return in.ok() ? std::optional(p) : std::nullopt;
}

std::optional<SetArrivals> read_set(RosReader in) {
  SetArrivals s;
  (void)in.header();
  s.number = in.get<std::uint64_t>();
  if (in.get<std::uint32_t>() != s.at.size()) return std::nullopt;
  for (Stamp& arrival : s.at) arrival = Stamp(in.get<std::int64_t>());
  return in.ok() ? std::optional(s) : std::nullopt;
}

/// The bytes that end a message, as many as it says.
std::optional<std::span<const std::uint8_t>> data(std::span<const std::uint8_t> message,
                                                  RosReader* in) {
  const auto size = in->get<std::uint32_t>();
  if (!in->ok() || size > message.size() - in->position()) return std::nullopt;
  return message.subspan(in->position(), size);
}

/// The recorder's kinds, without `read`, whose bytes have a topic of their own.
std::optional<LineEvent> read_line_event(std::span<const std::uint8_t> message) {
  RosReader in(message, detail::MessageEncoding::cdr);
  LineEvent e;
  e.time = host(&in);
  const auto kind = in.get<std::uint8_t>();
  e.value = in.get<std::uint32_t>();
  const auto bytes = data(message, &in);
  if (!bytes || kind > static_cast<std::uint8_t>(LineEvent::Kind::timeout)) return std::nullopt;
  e.kind = static_cast<LineEvent::Kind>(kind);
  e.bytes = *bytes;
  return e;
}

class Scan {
 public:
  Scan(const std::filesystem::path& folder, DeviceRecording* out) : folder_(folder), out_(*out) {}

  void take(const detail::BagMessage& m) {
    const std::string& topic = m.channel->topic;
    const std::string& type = m.channel->type;
    const bool line = type == "std_msgs/UInt8MultiArray" || type == "vergence_msgs/LineEvent";
    if (!line && type != "vergence_msgs/DeviceFrame" && type != "vergence_msgs/DeviceGone" &&
        type != "vergence_msgs/Pulse" && type != "vergence_msgs/RigSet")
      return;
    if (m.place.size > kMostMessage) return note(false);
    bytes_.resize(m.place.size);
    if (!m.bytes->read(m.place.offset, bytes_)) return note(false);
    RosReader in(bytes_, detail::MessageEncoding::cdr);
    if (topic.starts_with("/ins/") && line) return note(take_line(m, &out_.ins));
    if (topic.starts_with("/trigger_board/") && line) return note(take_line(m, &out_.board));
    if (type == "vergence_msgs/Pulse") return note(add(read_pulse(in), &out_.pulses));
    if (type == "vergence_msgs/DeviceGone") return note(take_gone(in));
    if (type == "vergence_msgs/RigSet") return note(take_set(in));
    if (type == "vergence_msgs/DeviceFrame")
      if (auto* frames = frames_of(topic)) note(add(read_device_frame(in), frames));
  }

  /// Cameras by the topics of their images.
  void name_cameras(const std::vector<std::string>& image_topics) {
    for (const std::string& topic : image_topics)
      names_.push_back(topic.substr(0, topic.find('/', 1) + 1) + "device_frame");
  }

 private:
  void note(bool whole) noexcept { out_.damaged += whole ? 0 : 1; }
  void limit(std::size_t held, std::size_t most) const {
    if (held >= most) refuse(folder_, 0, "has a recording of more of its devices than is held");
  }

  template <class Value>
  bool add(const std::optional<Value>& value, std::vector<DeviceStep<Value>>* steps) {
    limit(steps->size(), kMostItems);
    if (value) steps->push_back({false, *value});
    return value.has_value();
  }

  bool take_gone(RosReader in) {
    const HostStamp when = host(&in);
    const auto camera = in.get<std::int32_t>();
    if (!in.ok() || camera < -1 || camera >= kMaxCameras) return false;
    const auto add_to = [&](auto* steps) {
      limit(steps->size(), kMostItems);
      steps->push_back({true, {}});
      steps->back().value.arrival = when;
    };
    if (camera < 0)
      add_to(&out_.pulses);
    else
      add_to(&out_.cameras[static_cast<std::size_t>(camera)]);
    return true;
  }

  bool take_set(RosReader in) {
    const auto set = read_set(in);
    if (!set || (!out_.sets.empty() && set->number <= out_.sets.back().number)) return false;
    limit(out_.sets.size(), kMostItems);
    out_.sets.push_back(*set);
    return true;
  }

  bool take_line(const detail::BagMessage& m, LineRecord* line) {
    limit(line->steps.size(), kMostItems);
    limit(line->bytes.size(), kMostLineBytes);
    if (m.channel->type == "vergence_msgs/LineEvent") {
      const auto event = read_line_event(bytes_);
      if (event) line->add(*event);
      return event.has_value();
    }
    RosReader in(bytes_, detail::MessageEncoding::cdr);
    if (in.get<std::uint32_t>() != 0) return false;  // no dimensions
    (void)in.get<std::uint32_t>();
    const auto bytes = data(bytes_, &in);
    if (bytes) line->add({LineEvent::Kind::read, HostStamp(m.log_time), 0, *bytes});
    return bytes.has_value();
  }

  [[nodiscard]] std::vector<DeviceStep<Frame>>* frames_of(const std::string& topic) noexcept {
    for (std::size_t k = 0; k < names_.size() && k < out_.cameras.size(); ++k)
      if (names_[k] == topic) return &out_.cameras[k];
    return nullptr;
  }

  const std::filesystem::path& folder_;
  DeviceRecording& out_;
  std::vector<std::string> names_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

void LineRecord::add(const LineEvent& event) {
  steps.push_back({event, bytes.size(), event.bytes.size()});
  steps.back().event.bytes = {};
  bytes.insert(bytes.end(), event.bytes.begin(), event.bytes.end());
}

HostStamp DeviceRecording::end() const noexcept {
  HostStamp last{};
  for (const auto& frames : cameras)
    if (!frames.empty()) last = std::max(last, frames.back().value.arrival);
  if (!pulses.empty()) last = std::max(last, pulses.back().value.arrival);
  return last;
}

DeviceRecording read_device_recording(const std::filesystem::path& folder,
                                      const SessionDescription& description) {
  DeviceRecording out;
  Scan scan(folder, &out);
  scan.name_cameras(description.cameras);
  for (const detail::BagFile& file : detail::open_bag_files(detail::BagFormat::mcap, folder))
    (void)detail::scan_bag(detail::BagFormat::mcap, *file.bytes,
                           [&](const detail::BagMessage& m) { scan.take(m); });
  return out;
}

}  // namespace vergence::app
