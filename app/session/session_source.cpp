#include "app/session/session_source.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "app/devices/rig_settings.hpp"
#include "app/runtime/background_thread.hpp"

namespace vergence::app {
namespace {

/// A word of calibrations.csv, which are constants.
const char* to_cause(const std::string& word) {
  for (const char* known : {"state_file", "whole_drive"})
    if (word == known) return known;
  return "given";
}

/// Facts of a replay of frames `first` to before `end`. `other`: as SessionSource's.
SourceFacts facts_of_recording(const ReplayRequest& request, const RecordedSession& session,
                               std::optional<StartingCalibration> other, std::size_t first,
                               std::size_t end) {
  const SessionDescription& d = session.description();
  const bool as_then = !other;
  SourceFacts facts;
  facts.begin = other ? std::move(*other) : recorded_beginning(d, request.data.string());
  facts.adoption = as_then ? d.adoption : Adoption::after_fixed_frames;
  facts.frames = end - first;
  facts.first = session.frames()[first].given.stamp;
  if (d.ins && !session.readings().empty())
    facts.ins = SourceIns{comparison_options(request.configuration), InsSource::recording,
                          d.mount_source, session.readings().capacity() * sizeof(InsRecord)};
  for (const std::string& message : session.remarks())
    facts.remarks.push_back({message, "data", !request.session.quiet});
  if (as_then && !session.complete())
    facts.remarks.push_back({"the recording is incomplete: the poses differ from those of the run",
                             "data", !request.session.quiet});
  for (int k = 0; k < facts.begin.file.rig.cameras; ++k) {
    const Intrinsics& lens = facts.begin.file.rig.intrinsics[static_cast<std::size_t>(k)];
    facts.image_bytes +=
        static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height);
  }
  return facts;
}

/// Time-dependent decisions of a recorded frame, which the estimator repeats.
void decide_as_then(const FrameRecord& given, SourceFrame* frame) noexcept {
  frame->solver_idle = given.solver_done;
  frame->rig.effort = given.sample.effort;
}

/// A calibration was requested before that frame.
SourceEvent recalibration_as_then(Stamp stamp) noexcept {
  return {.record = {stamp, "recalibration_requested",
                     "a recalibration was requested, as in the recorded run"},
          .recalibrate = true};
}

/// A recorded session as the source of another: the estimator is given what it was given then, in
/// the same order, images that were missing included, and its solver answers at the same frames. So
/// the poses are those of the drive, bit for bit, unless something else is asked for.
///
/// Ownership  Holds the recording. `request` outlives it.
/// Errors     The constructor throws InputError: a damaged description, images of another size than
///            the calibration's.
class SessionSource final : public FrameSource {
 public:
  SessionSource(const ReplayRequest& request, RecordedSession session,
                std::optional<StartingCalibration> other)
      : request_(request),
        session_(std::move(session)),
        other_(other.has_value()),
        end_(std::min(session_.frames().size(),
                      request.start + request.frames.value_or(session_.frames().size()))),
        next_frame_(request.start) {
    facts_ = facts_of_recording(request, session_, std::move(other), next_frame_, end_);
    const RigCalibration& rig = facts_.begin.file.rig;
    for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
      pixels_[k].resize(static_cast<std::size_t>(rig.intrinsics[k].width) *
                        static_cast<std::size_t>(rig.intrinsics[k].height));
    for (std::size_t i = next_frame_; i < end_; ++i) {
      const RecordedFrame& frame = session_.frames()[i];
      for (std::size_t k = 0; k < kMaxCameras; ++k) {
        const RecordedImage& image = frame.images[k];
        if (image.offset != 0 &&
            (k >= static_cast<std::size_t>(rig.cameras) || image.width != rig.intrinsics[k].width ||
             image.height != rig.intrinsics[k].height))
          throw InputError(
              fmt::format("{}: frame {} of the recording: the image of camera {} has {} x {} "
                          "pixels, unlike the calibration; use the calibration of this recording",
                          request.data.string(), frame.given.number, k, image.width, image.height));
      }
    }
    // From the middle of a drive: what came before is not for it.
    if (next_frame_ > 0) next_reading_ = session_.frames()[next_frame_ - 1].readings;
  }

  [[nodiscard]] const SourceFacts& facts() const noexcept override { return facts_; }
  void start(std::vector<std::string>* /*faults*/) override {}
  [[nodiscard]] bool next(SourceItem* item) noexcept override {
    if (stopped_.load(std::memory_order_relaxed)) return false;
    const bool frames_left = next_frame_ < end_;
    const std::size_t readings = frames_left ? session_.frames()[next_frame_].readings
                                 : end_ == session_.frames().size() ? session_.readings().size()
                                                                    : next_reading_;
    if (facts_.ins && next_reading_ < readings) {
      *item = session_.readings()[next_reading_++];
      return true;
    }
    if (!frames_left) return false;
    const RecordedFrame& frame = session_.frames()[next_frame_];
    if (frame.given.recalibration_requested && !recalibration_reported_) {
      recalibration_reported_ = true;
      *item = recalibration_as_then(frame.given.stamp);
      return true;
    }
    recalibration_reported_ = false;
    ++next_frame_;
    *item = load(frame);
    return true;
  }
  void done(const PoseSample& /*sample*/) noexcept override {}
  void stop() noexcept override { stopped_.store(true, std::memory_order_relaxed); }
  void finish(Progress* progress) override {
    if (images_missing_ > 0)
      progress->print(
          fmt::format("vergence: {} images are damaged or missing in the recording; frames were "
                      "processed without them",
                      images_missing_));
    // Frees memory before the report is written.
    session_.clear_frames();
  }
  void describe(const SessionTotals& /*totals*/, const Estimator& /*estimator*/,
                SummaryInput* input) const override {
    input->devices.emplace_back("images_missing", images_missing_);
  }
  void print_metrics(const SummaryInput& /*input*/, Progress* progress) const override {
    if (!other_ && session_.complete() && images_missing_ == 0 && request_.start == 0)
      progress->print(
          "the estimator received the same input as in the recorded run; compare with " +
          (request_.data / "trajectory.tum").string());
  }

 private:
  [[nodiscard]] SourceFrame load(const RecordedFrame& recorded) noexcept {
    const auto begun = std::chrono::steady_clock::now();
    const FrameRecord& given = recorded.given;
    SourceFrame frame;
    frame.rig.number = given.number;
    frame.rig.stamp = given.stamp;
    frame.rig.stamp_error = given.stamp_error;
    frame.rig.spread = given.spread;
    frame.rig.pairing = static_cast<Pairing>(
        std::min(given.pairing, static_cast<std::uint8_t>(Pairing::contradicted)));
    frame.rig.cameras = facts_.begin.file.rig.cameras;
    if (!other_) decide_as_then(given, &frame);
    auto read = [&] {
      for (std::size_t k = 0; k < static_cast<std::size_t>(frame.rig.cameras); ++k) {
        if ((given.images_present >> k & 1U) == 0) continue;
        const RecordedImage& image = recorded.images[k];
        if (session_.read(recorded, k, pixels_[k].data(), static_cast<std::size_t>(image.width)))
          frame.rig.images[k] = {pixels_[k].data(), image.width, image.height, image.width};
        else
          ++images_missing_;
      }
    };
    auto wait = [] {};
    reader_.run(TaskRef(wait), TaskRef(read));
    frame.decode_ms =
        std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - begun).count();
    return frame;
  }

  const ReplayRequest& request_;
  // Has no frames after finish().
  RecordedSession session_;
  // True if the replay begins at another frame than the recorded run.
  const bool other_;
  // Index after the last frame of this replay.
  const std::size_t end_;
  SourceFacts facts_;
  // Images of the current frame.
  std::array<std::vector<std::uint8_t>, kMaxCameras> pixels_;
  std::atomic<bool> stopped_{false};

  // Used by the estimator's thread; read by others after it has joined.
  std::size_t next_frame_ = 0, next_reading_ = 0;
  // True if the recalibration of the next frame was reported.
  bool recalibration_reported_ = false;
  std::uint64_t images_missing_ = 0;
  // Decoding allocates and therefore runs in its own thread.
  ThreadRunner reader_{BackgroundThread::Role::reader};
};

}  // namespace

StartingCalibration recorded_beginning(const SessionDescription& d, const std::string& name) {
  StartingCalibration begin;
  begin.file = parse_calibration(d.calibration, name + " (calibration)");
  begin.nominal = parse_calibration(d.nominal, name + " (nominal)").rig;
  begin.trust = d.trust;
  begin.cause = to_cause(d.cause);
  begin.source = d.source;
  return begin;
}

std::unique_ptr<FrameSource> session_source(const ReplayRequest& request, RecordedSession session,
                                            std::optional<StartingCalibration> other) {
  return std::make_unique<SessionSource>(request, std::move(session), std::move(other));
}

}  // namespace vergence::app
