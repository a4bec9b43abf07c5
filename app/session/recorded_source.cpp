#include "app/session/recorded_source.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace vergence::app {
namespace {

int width_of(const StereoSequence& s) { return s.calibration.intrinsics[0].width; }
int height_of(const StereoSequence& s) { return s.calibration.intrinsics[0].height; }

/// Frames that cannot be read and are listed: 140 kB of events. A data set whose images are
/// elsewhere has a million.
constexpr std::uint64_t kMostListed = 1000;

SourceEvent event_of(const DecodedPair& pair, std::uint64_t unread) noexcept {
  SourceEvent event;
  event.skipped = true;
  event.listed = unread <= kMostListed + 1;
  event.record.stamp = pair.stamp;
  event.record.kind = pair.kind;
  event.record.set_sentence(
      unread <= kMostListed
          ? pair.note.data()
          : "1000 frames could not be read; further ones are counted (summary.json: skipped)");
  event.record.fields[0] = {"frame", static_cast<std::int64_t>(pair.frame)};
  return event;
}

void report_earth_errors(const EarthFigures& earth, double placement_m, Progress* progress) {
  const EarthErrors& e = earth.errors;
  if (e.poses > 0)
    progress->say(
        fmt::format("beside the INS after the placement: {:.2f} m at the end, {:.2f} % of {:.1f} "
                    "m; at most {:.2f} m; heading off by "
                    "{:.2f} deg rms, {:.2f} deg at the end",
                    e.horizontal_end_m, e.way_m > 0 ? 100 * e.horizontal_end_m / e.way_m : 0,
                    e.way_m, e.horizontal_most_m, e.heading_rms_deg, e.heading_end_deg));
  else
    progress->say(
        fmt::format("nothing is compared after the placement: it takes {:g} m with a fix "
                    "(comparison.placement_m)",
                    placement_m));
}

}  // namespace

RecordedSource::RecordedSource(const ReplayRequest& request, StereoSequence sequence,
                               StartingCalibration begin, Trajectory truth, ReplayedIns ins)
    : request_(request),
      sequence_(std::move(sequence)),
      ins_(std::move(ins)),
      count_(std::min(request.frames.value_or(sequence_.pairs.size()),
                      sequence_.pairs.size() - request.start)),
      frames_arena_(arena_size(FramePool::memory_needed(width_of(sequence_), height_of(sequence_),
                                                        FrameDecoder::kSlots))),
      pool_(width_of(sequence_), height_of(sequence_), FrameDecoder::kSlots, frames_arena_),
      skipped_(sequence_.left_out) {
  facts_.begin = std::move(begin);
  facts_.truth = std::move(truth);
  facts_.frames = count_;
  facts_.first = sequence_.pairs[request.start].stamp;
  if (!ins_.readings.empty())
    facts_.ins = SourceIns{ins_.options, InsSource::recording, ins_.mount_source,
                           ins_.readings.capacity() * sizeof(RecordedReading)};
  for (const std::vector<std::string>* remarks : {&sequence_.remarks, &ins_.remarks})
    for (const std::string& sentence : *remarks)
      facts_.remarks.push_back({sentence, "data", !request.session.quiet});
  facts_.assumptions = sequence_.assumptions;
  if (!facts_.assumptions.empty())
    facts_.remarks.push_back({fmt::format("assumed: {}", fmt::join(facts_.assumptions, "; ")),
                              "data", !request.session.quiet});
  // Otherwise the length is the user's own, and where the right camera sits is to be found.
  if (!request.from_scratch && !request.known) {
    const RigCalibration& rig = facts_.begin.file.rig;
    facts_.remarks.push_back({baseline_sentence(rig) + " (" + facts_.begin.source + ")", nullptr,
                              !request.session.quiet});
    if (std::string doubt = baseline_doubt(rig); !doubt.empty())
      facts_.remarks.push_back({std::move(doubt), "calibration", !request.session.quiet});
  }
  facts_.image_bytes = frames_arena_.capacity();
  facts_.ring_bytes = sizeof(FrameDecoder);
}

void RecordedSource::start(std::vector<std::string>* /*faults*/) {
  decoder_ = std::make_unique<FrameDecoder>(sequence_, request_.start, count_, pool_);
}

// ---- the estimator's thread

bool RecordedSource::next(SourceItem* item) noexcept {
  if (!waiting_ && !ended_) {
    ended_ = !decoder_->next(&pair_);
    if (!ended_ && !pair_.decoded) {
      ++skipped_;
      *item = event_of(pair_, ++unread_);
      return true;
    }
    waiting_ = !ended_;
  }
  // Readings go before the first frame that is not older; those after the last frame at the end.
  if (next_reading_ < ins_.readings.size()) {
    const RecordedReading& reading = ins_.readings[next_reading_];
    if (ended_ || reading.sample.stamp <= pair_.stamp) {
      ++next_reading_;
      *item = InsRecord{reading.sample, reading.quality};
      return true;
    }
  }
  if (ended_) return false;
  waiting_ = false;
  SourceFrame frame;
  frame.rig.number = pair_.frame;
  frame.rig.stamp = pair_.stamp;
  frame.rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k) frame.rig.images[k] = pool_.view(pair_.slots[k]);
  frame.decode_ms = pair_.decode_ms;
  *item = frame;
  return true;
}

void RecordedSource::done(const PoseSample& /*sample*/) noexcept { decoder_->release(pair_); }

void RecordedSource::stop() noexcept { decoder_->stop(); }

// ---- the caller's thread

void RecordedSource::finish(Progress* /*progress*/, std::vector<std::string>* /*faults*/) {
  decoder_.reset();
}

void RecordedSource::describe(const SessionTotals& /*totals*/, const Estimator& /*estimator*/,
                              SummaryInput* input) const {
  input->skipped = skipped_;
}

void RecordedSource::print_figures(const SessionTotals& /*totals*/, const SummaryInput& input,
                                   Progress* progress) const {
  if (input.evaluation && input.evaluation->status == EvaluationStatus::ok) {
    const TrajectoryEvaluation& e = *input.evaluation;
    const SegmentErrors& near = e.segments[1];
    const std::string segments =
        near.count > 0 ? fmt::format("; segments of 10 to 50 m {:.2f} %", 100 * near.translation)
                       : "";
    progress->say(fmt::format(
        "against the reference over {:.2f} m: ATE {:.4f} m, {:.4f} m after a scale of {:.4f}{}",
        e.path_reference, e.ate_se3.rmse, e.ate_sim3.rmse, e.sim3.scale, segments));
    if (!facts_.ins)
      progress->say(fmt::format("next: vergence evaluate {} {}",
                                (request_.session.out / "trajectory.tum").string(),
                                request_.data.string()));
  } else if (!facts_.ins) {
    progress->say(
        fmt::format("there is no reference to compare with; next: vergence evaluate {} REFERENCE",
                    (request_.session.out / "trajectory.tum").string()));
  }
  if (facts_.ins)
    report_earth_errors(*input.earth, request_.configuration.comparison.placement_m, progress);
}

}  // namespace vergence::app
