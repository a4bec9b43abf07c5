#include "app/session/recorded_source.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "app/config/calibration_checks.hpp"
#include "app/datasets/frame_decoder.hpp"
#include "app/devices/rig_settings.hpp"
#include "core/comparison/attitude_check.hpp"
#include "core/math/robust.hpp"
#include "core/memory/frame_pool.hpp"

namespace vergence::app {

namespace {

// Samples this long before the first frame and after the last one are used.
constexpr Duration kAround = Duration::seconds(1);
// Heading sigma of extrinsics from a calibration of three sensors, with a principal point error of
// 5 px.
constexpr double kPublishedHeading = 0.3 * std::numbers::pi / 180;
// A sample that is late by half an interval is no gap; a missing one is.
constexpr double kMaxOfInterval = 1.5;

bool has_mount(const InsSettings& ins) {
  const auto zero = [](double v) { return v == 0; };
  return !std::ranges::all_of(ins.lever_arm_m, zero) ||
         !std::ranges::all_of(ins.boresight_deg, zero);
}

Duration usual_interval(const std::vector<InsRecord>& readings) {
  std::vector<std::int64_t> ns;
  for (std::size_t i = 1; i < readings.size(); ++i)
    ns.push_back((readings[i].sample.stamp - readings[i - 1].sample.stamp).ns());
  return ns.empty() ? Duration{} : Duration::nanoseconds(median(std::span(ns)));
}

/// False: none is left.
bool keep_around(const StereoSequence& sequence, std::size_t first, std::size_t count,
                 std::vector<InsRecord>* readings) {
  Stamp begin = sequence.pairs[first].stamp, end = begin;
  for (std::size_t i = first; i < first + count; ++i) {
    begin = std::min(begin, sequence.pairs[i].stamp);
    end = std::max(end, sequence.pairs[i].stamp);
  }
  std::erase_if(*readings, [&](const InsRecord& r) {
    return r.sample.stamp < begin - kAround || r.sample.stamp > end + kAround;
  });
  return !readings->empty();
}

/// A recording's whole path is known before the first frame: an attitude that contradicts most
/// of it is taken out from the beginning, and its heading is the course over ground. → how many
/// readings
std::size_t drop_contradicted(const ComparisonOptions& options, std::vector<InsRecord>* readings) {
  AttitudeCheck check;
  std::optional<LocalTangentPlane> plane;
  std::vector<std::optional<double>> courses;
  bool contradicted = false;
  for (const InsRecord& r : *readings) {
    const InsSample& s = r.sample;
    const bool fixed = s.fix == FixStatus::fix_2d || s.fix == FixStatus::fix_3d;
    if (fixed && s.attitude_valid && s.position.plausible()) {
      if (!plane) plane.emplace(s.position);
      const auto& [x, y, z, w] = s.q_enu_ins;
      const Vec3 view = Eigen::Quaterniond(w, x, y, z).normalized() * options.T_ins_left.R.col(2);
      check.add(plane->to_enu(s.position).head<2>(),
                s.position_sigma > 0 ? s.position_sigma : options.position_sigma_m,
                std::atan2(view.y(), view.x()));
    }
    contradicted = contradicted || check.contradicted();
    courses.push_back(check.course());
  }
  if (!contradicted || !check.mostly_off()) return 0;
  const auto first = std::ranges::find_if(courses, [](const auto& c) { return c.has_value(); });
  std::size_t dropped = 0;
  for (std::size_t i = 0; i < readings->size(); ++i) {
    InsSample& s = (*readings)[i].sample;
    if (!s.attitude_valid) continue;
    s.attitude_valid = false;
    s.heading_source = HeadingSource::course;
    s.yaw_enu = courses[i].value_or(first->value_or(0));
    ++dropped;
  }
  return dropped;
}

std::string mount_message(const Transform& T_ins_left, const std::string& source) {
  const Vec3 turn = boresight_of(T_ins_left.R) * (180 / std::numbers::pi);
  const Vec3& arm = T_ins_left.t;
  return fmt::format(
      "INS extrinsics: lever arm [{:.3f}, {:.3f}, {:.3f}] m, boresight [{:.3f}, {:.3f}, {:.3f}] "
      "deg, from {}",
      arm.x(), arm.y(), arm.z(), turn.x(), turn.y(), turn.z(), source);
}

/// Frames that cannot be read and are listed: 140 kB of events. A data set whose images are
/// elsewhere has a million.
constexpr std::uint64_t kMaxListed = 1000;

SourceEvent make_event(const DecodedPair& pair, std::uint64_t unread) noexcept {
  SourceEvent event;
  event.skipped = true;
  event.listed = unread <= kMaxListed + 1;
  event.record = {
      pair.stamp, pair.kind,
      unread <= kMaxListed
          ? pair.issue.data()
          : "1000 frames could not be read; further ones are only counted (summary.json: skipped)"};
  event.record.fields[0] = {"frame", static_cast<std::int64_t>(pair.frame)};
  return event;
}

/// A recorded drive as the source of a session. Nothing is dropped; an INS that was recorded comes
/// in the order of its stamps, before the frames that are not older.
///
/// Ownership  Holds the sequence and the pool that its images are decoded into. `request` outlives
///            it.
class RecordedSource final : public FrameSource {
 public:
  RecordedSource(const ReplayRequest& request, StereoSequence sequence, StartingCalibration begin,
                 Trajectory truth, ReplayedIns ins)
      : request_(request),
        sequence_(std::move(sequence)),
        ins_(std::move(ins)),
        count_(request.count_of(sequence_)),
        pool_(sequence_.calibration.intrinsics[0].width, sequence_.calibration.intrinsics[0].height,
              FrameDecoder::kSlots, frames_arena_),
        skipped_(sequence_.left_out) {
    facts_.begin = std::move(begin);
    facts_.truth = std::move(truth);
    facts_.frames = count_;
    facts_.first = sequence_.pairs[request.start].stamp;
    if (!ins_.readings.empty())
      facts_.ins = SourceIns{ins_.options, InsSource::recording, ins_.mount_source,
                             ins_.readings.capacity() * sizeof(InsRecord)};
    for (const std::vector<std::string>* remarks : {&sequence_.remarks, &ins_.remarks})
      for (const std::string& message : *remarks)
        facts_.remarks.push_back({message, "data", !request.session.quiet});
    facts_.assumptions = sequence_.assumptions;
    if (!facts_.assumptions.empty())
      facts_.remarks.push_back({fmt::format("assumed: {}", fmt::join(facts_.assumptions, "; ")),
                                "data", !request.session.quiet});
    // Otherwise the length is the user's own, and where the right camera sits is to be found.
    if (!request.from_scratch && !request.known) {
      const RigCalibration& rig = facts_.begin.file.rig;
      facts_.remarks.push_back({baseline_message(rig) + " (" + facts_.begin.source + ")", nullptr,
                                !request.session.quiet});
      if (std::string warning = baseline_warning(rig); !warning.empty())
        facts_.remarks.push_back({std::move(warning), "calibration", !request.session.quiet});
    }
    facts_.image_bytes = frames_arena_.used();
    facts_.ring_bytes = sizeof(FrameDecoder);
  }

  [[nodiscard]] const SourceFacts& facts() const noexcept override { return facts_; }
  void start(std::vector<std::string>* /*faults*/) override {
    decoder_ = std::make_unique<FrameDecoder>(sequence_, request_.start, count_, pool_);
  }
  [[nodiscard]] bool next(SourceItem* item) noexcept override {
    if (!waiting_ && !ended_) {
      ended_ = !decoder_->next(&pair_);
      if (!ended_ && !pair_.decoded) {
        ++skipped_;
        *item = make_event(pair_, ++unread_);
        return true;
      }
      waiting_ = !ended_;
    }
    // Readings go before the first frame that is not older; those after the last frame at the end.
    if (next_reading_ < ins_.readings.size()) {
      const InsRecord& reading = ins_.readings[next_reading_];
      if (ended_ || reading.sample.stamp <= pair_.stamp) {
        ++next_reading_;
        *item = reading;
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
  void done(const PoseSample& /*sample*/) noexcept override { decoder_->release(pair_); }
  void stop() noexcept override { decoder_->stop(); }
  void finish(Progress* /*progress*/) override { decoder_.reset(); }
  void describe(const SessionTotals& /*totals*/, const Estimator& /*estimator*/,
                SummaryInput* input) const override {
    input->skipped = skipped_;
  }
  void print_metrics(const SummaryInput& input, Progress* progress) const override {
    print_evaluation("the reference", input.evaluation, progress);
  }

 private:
  const ReplayRequest& request_;
  const StereoSequence sequence_;
  const ReplayedIns ins_;
  // Number of frames in this replay.
  const std::size_t count_;
  Arena frames_arena_;
  FramePool pool_;
  SourceFacts facts_;
  std::unique_ptr<FrameDecoder> decoder_;

  // Used by the estimator's thread; read by others after it has joined.
  // Last pair returned, or the one that waits until its INS samples have been returned.
  DecodedPair pair_{};
  // True if `pair_` was not returned yet.
  bool waiting_ = false;
  // True if there are no more pairs.
  bool ended_ = false;
  std::size_t next_reading_ = 0;
  // Number of frames in `skipped_` that the decoder reached.
  std::uint64_t unread_ = 0;
  std::uint64_t skipped_ = 0;
};

}  // namespace

ReplayedIns replayed_ins(const ReplayRequest& request, const StereoSequence& sequence) {
  const Configuration& c = request.configuration;
  ReplayedIns out{sequence.ins
                      ? *sequence.ins
                      : read_recorded_ins(request.format, request.data,
                                          {c.kitti_raw.left, c.kitti_raw.right}, !has_mount(c.ins)),
                  comparison_options(c)};
  if (out.readings.empty()) return out;
  if (!keep_around(sequence, request.start, request.count_of(sequence), &out.readings)) {
    out.remarks.push_back("no INS samples at the time of these frames; poses are not compared");
    return out;
  }
  const Duration usual = usual_interval(out.readings);
  const Duration rarely = Duration::seconds(kMaxOfInterval * usual.to_seconds());
  out.options.max_gap = std::max(out.options.max_gap, rarely);
  out.options.max_wait = std::max(out.options.max_wait, rarely);
  if (out.T_ins_left) {
    out.options.T_ins_left = *out.T_ins_left;
    if (out.options.heading_sigma_rad == 0) out.options.heading_sigma_rad = kPublishedHeading;
  } else {
    out.mount_source = has_mount(c.ins)
                           ? "the configuration"
                           : "defaults: ins.lever_arm_m and ins.boresight_deg are not set";
  }
  if (const std::size_t dropped = drop_contradicted(out.options, &out.readings); dropped > 0)
    out.remarks.push_back(fmt::format(
        "the attitude of {} INS samples is not used, because it differs from the course over "
        "ground by more than 30° for 50 m or more; the course is used instead",
        dropped));
  out.remarks.push_back(mount_message(out.options.T_ins_left, out.mount_source));
  return out;
}

std::unique_ptr<FrameSource> recorded_source(const ReplayRequest& request, StereoSequence sequence,
                                             StartingCalibration begin, Trajectory truth,
                                             ReplayedIns ins) {
  return std::make_unique<RecordedSource>(request, std::move(sequence), std::move(begin),
                                          std::move(truth), std::move(ins));
}

}  // namespace vergence::app
