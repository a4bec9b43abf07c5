#include "app/session/device_replay_source.hpp"

#include <algorithm>
#include <string_view>
#include <variant>

#include <fmt/format.h>

#include "app/devices/drive_devices.hpp"
#include "app/session/session_source.hpp"

namespace vergence::app {
namespace {

SourceEvent event_of(const DeviceEvent& event, const TimingMonitor& time) noexcept {
  const TimingMonitor::Sentence sentence = time.of_device(event);
  SourceEvent out;
  out.record.stamp = event.stamp;
  out.record.kind = sentence.kind;
  out.record.set_sentence(sentence.text.data());
  return out;
}

bool same_reading(const InsSample& a, const InsSample& b) noexcept {
  return a.stamp == b.stamp && a.stamp_error == b.stamp_error && a.fix == b.fix &&
         a.position.latitude_deg == b.position.latitude_deg &&
         a.position.longitude_deg == b.position.longitude_deg &&
         a.position.height_m == b.position.height_m && a.velocity_enu == b.velocity_enu &&
         a.q_enu_ins == b.q_enu_ins;
}

}  // namespace

DeviceReplaySource::DeviceReplaySource(const ReplayRequest& request, RecordedSession session,
                                       std::optional<StartingCalibration> other)
    : request_(request),
      session_(std::move(session)),
      recording_(read_device_recording(request.data, session_.description())),
      other_(other.has_value()),
      end_(std::min(session_.frames().size(),
                    request.start + request.frames.value_or(session_.frames().size()))),
      facts_(facts_of_recording(request, session_, std::move(other), request.start, end_)),
      devices_(request.configuration,
               {session_.description(), recording_, session_.readings(), request.data.string()},
               [this](std::size_t camera, std::size_t frame) { return pixels(camera, frame); }),
      time_(request.configuration.sync.mode, true) {
  if (facts_.begin.file.rig.cameras != static_cast<int>(devices_.cameras().size()))
    throw InputError(fmt::format("{}: the recording is of {} cameras, the calibration of {}",
                                 request.data.string(), devices_.cameras().size(),
                                 facts_.begin.file.rig.cameras));
  tie_images_to_frames();
  if (recording_.damaged > 0)
    facts_.remarks.push_back(
        {fmt::format("{} messages of the devices are damaged and were left out",
                     recording_.damaged),
         "data", !request.session.quiet});
  Acquisition::Options options = devices_.acquisition_options();
  options.stamp_grid = stamp_grid(request.configuration);
  acquisition_ = std::make_unique<Acquisition>(devices_.cameras(), devices_.ins(),
                                               devices_.trigger(), options);
}

void DeviceReplaySource::tie_images_to_frames() {
  std::size_t i = 0;
  const auto& frames = session_.frames();
  for (const SetArrivals& set : recording_.sets) {
    while (i < frames.size() && frames[i].given.number < set.number) ++i;
    if (i == frames.size()) break;
    if (frames[i].given.number != set.number) continue;
    for (std::size_t k = 0; k < kMaxCameras; ++k)
      if (set.at[k] != Stamp{}) frames_by_arrival_[k].emplace_back(set.at[k], i);
  }
  for (auto& of_camera : frames_by_arrival_) std::sort(of_camera.begin(), of_camera.end());
  for (std::size_t k = 0; k < kMaxCameras; ++k) {
    std::size_t most = 0;
    for (const RecordedFrame& frame : frames)
      most = std::max(most, static_cast<std::size_t>(frame.images[k].width) *
                                static_cast<std::size_t>(frame.images[k].height));
    pixels_[k].resize(most);
  }
}

void DeviceReplaySource::start(std::vector<std::string>* /*faults*/) {
  start_acquisition(acquisition_.get());
}

// ---- the estimator's thread

std::size_t DeviceReplaySource::frame_of(std::size_t camera, Stamp arrival) const noexcept {
  const auto& all = frames_by_arrival_[camera];
  const auto found = std::lower_bound(all.begin(), all.end(), std::pair(arrival, std::size_t{0}));
  return found != all.end() && found->first == arrival ? found->second : kNone;
}

std::size_t DeviceReplaySource::frame_of(const SyncedSet& set) const noexcept {
  for (std::size_t k = 0; k < kMaxCameras; ++k)
    if (set.present[k])
      if (const std::size_t i = frame_of(k, Stamp(set.arrivals[k].ns())); i != kNone) return i;
  return kNone;
}

ImageView DeviceReplaySource::pixels(std::size_t camera, std::size_t frame) noexcept {
  const Stamp arrival(recording_.cameras[camera][frame].value.arrival.ns());
  const std::size_t i = frame_of(camera, arrival);
  if (i == kNone || i < request_.start || i >= end_) return {};
  const RecordedFrame& recorded = session_.frames()[i];
  const RecordedImage& image = recorded.images[camera];
  const Intrinsics& lens = facts_.begin.file.rig.intrinsics[camera];
  if (image.width != lens.width || image.height != lens.height ||
      !session_.read(recorded, camera, pixels_[camera].data(),
                     static_cast<std::size_t>(image.width))) {
    ++images_missing_;
    return {};
  }
  return {pixels_[camera].data(), image.width, image.height, image.width};
}

bool DeviceReplaySource::next(SourceItem* item) noexcept {
  if (recalibration_ != kNone) {  // was said; now its frame
    (void)take(in_hand_, item);
    return true;
  }
  for (Acquired got; acquisition_->next(&got);) {
    if (const auto* reading = std::get_if<AcquiredReading>(&got)) {
      compare(reading->sample);
      *item = InsRecord{reading->sample, reading->quality};
      return true;
    }
    if (const auto* event = std::get_if<DeviceEvent>(&got)) {
      *item = event_of(*event, time_);
      return true;
    }
    in_hand_ = *std::get_if<AcquiredFrame>(&got);
    if (take(in_hand_, item)) return true;
    acquisition_->release(in_hand_);
  }
  return false;
}

bool DeviceReplaySource::take(const AcquiredFrame& frame, SourceItem* item) noexcept {
  const std::size_t i = frame_of(frame.set);
  if (i == kNone || i < request_.start || i >= end_) {
    found_.not_given += i == kNone ? 1 : 0;
    return false;
  }
  const FrameRecord& given = session_.frames()[i].given;
  if (given.recalibration_requested && recalibration_ != i) {
    recalibration_ = i;
    *item = recalibration_as_then(given.stamp);
    return true;
  }
  recalibration_ = kNone;
  holding_ = true;
  compare(frame, i);
  SourceFrame out;
  out.rig = frame.rig;
  if (!other_) decide_as_then(given, &out);
  *item = out;
  return true;
}

void DeviceReplaySource::compare(const AcquiredFrame& frame, std::size_t recorded) noexcept {
  const FrameRecord& given = session_.frames()[recorded].given;
  const RigFrame& now = frame.rig;
  bool same = now.number == given.number && now.stamp == given.stamp &&
              now.stamp_error == given.stamp_error && now.spread == given.spread &&
              static_cast<std::uint8_t>(now.pairing) == given.pairing;
  for (std::size_t k = 0; k < static_cast<std::size_t>(now.cameras); ++k) {
    const bool then = (given.images_present >> k & 1U) != 0;
    same = same && then == frame.set.present[k] &&
           (!then || frame_of(k, Stamp(frame.set.arrivals[k].ns())) == recorded);
  }
  if (!same && found_.frames == found_.frames_same) found_.first_other = given.number;
  ++found_.frames;
  found_.frames_same += same ? 1 : 0;
  const Duration off = now.stamp - given.stamp;
  found_.worst_stamp = std::max(found_.worst_stamp, off < Duration{} ? Duration{} - off : off);
}

/// Readings of a device are numbered; those that were dropped then are not in the recording.
void DeviceReplaySource::compare(const InsSample& sample) noexcept {
  const auto& then = session_.readings();
  while (next_reading_ < then.size() && then[next_reading_].sample.stamp < sample.stamp &&
         then[next_reading_].sample.number != sample.number)
    ++next_reading_;
  if (next_reading_ == then.size()) return;
  if (then[next_reading_].sample.number != sample.number) return;
  ++found_.readings;
  found_.readings_same += same_reading(sample, then[next_reading_].sample) ? 1 : 0;
  ++next_reading_;
}

void DeviceReplaySource::done(const PoseSample& /*sample*/) noexcept {
  if (std::exchange(holding_, false)) acquisition_->release(in_hand_);
}

// ---- the caller's thread

void DeviceReplaySource::halt() noexcept { acquisition_->join(); }

void DeviceReplaySource::finish(Progress* /*progress*/, std::vector<std::string>* /*faults*/) {}

std::vector<std::pair<std::string, std::uint64_t>> DeviceReplaySource::counters() const {
  const AcquisitionCounters& c = acquisition_->counters();
  std::vector<std::pair<std::string, std::uint64_t>> out{
      {"frames_replayed", found_.frames},
      {"frames_as_in_the_drive", found_.frames_same},
      {"sets_not_given_in_the_drive", found_.not_given},
      {"readings_compared", found_.readings},
      {"readings_as_in_the_drive", found_.readings_same},
      {"worst_stamp_difference_ns", static_cast<std::uint64_t>(found_.worst_stamp.ns())},
      {"pulses", c.pulses},
      {"clock_resets", c.clock_resets},
      {"images_missing", images_missing_}};
  const auto add = [&](const char* name, const LineReplayCounters* line) {
    if (line == nullptr) return;
    out.emplace_back(std::string(name) + "_reads", line->reads);
    out.emplace_back(std::string(name) + "_writes_as_recorded", line->writes);
    out.emplace_back(std::string(name) + "_writes_with_other_bytes", line->in_place);
    out.emplace_back(std::string(name) + "_writes_not_made", line->not_made);
    out.emplace_back(std::string(name) + "_writes_not_recorded", line->other);
  };
  add("ins_line", devices_.ins_line());
  add("board_line", devices_.board_line());
  return out;
}

void DeviceReplaySource::describe(const SessionTotals& /*totals*/, const Estimator& /*estimator*/,
                                  SummaryInput* input) const {
  for (const auto& counter : counters()) input->devices.push_back(counter);
}

void DeviceReplaySource::print_figures(const SessionTotals& /*totals*/,
                                       const SummaryInput& /*input*/, Progress* progress) const {
  const std::size_t wanted = end_ - request_.start;
  progress->say(fmt::format(
      "from the devices on: {} of {} frames paired and stamped as in the drive, {} of {} readings "
      "of the INS as they were; stamps at most {:.3f} ms apart",
      found_.frames_same, wanted, found_.readings_same, session_.readings().size(),
      static_cast<double>(found_.worst_stamp.ns()) * 1e-6));
  if (found_.frames < wanted)
    progress->say(
        fmt::format("{} frames of the drive did not come about again", wanted - found_.frames));
  if (found_.frames_same < found_.frames)
    progress->say(fmt::format("the first that is another is frame {}", found_.first_other));
}

}  // namespace vergence::app
