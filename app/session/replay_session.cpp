#include "app/session/replay_session.hpp"

#include <numbers>

#include "app/config/calibration_checks.hpp"
#include "app/datasets/foreign_calibration.hpp"
#include "app/datasets/frame_decoder.hpp"
#include "app/datasets/recorded_session.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/session/drive_calibration.hpp"
#include "core/comparison/attitude_check.hpp"
#include "core/math/robust.hpp"

namespace vergence::app {
namespace {

/// INS of a replayed sequence and the options of its comparison.
struct ReplayedIns : RecordedIns {
  ComparisonOptions options{};
};

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
  const auto [begin, end] = std::ranges::minmax_element(
      std::span(sequence.pairs).subspan(first, count), {}, &StereoPair::stamp);
  std::erase_if(*readings,
                [from = begin->stamp - kAround, to = end->stamp + kAround](const InsRecord& r) {
                  return r.sample.stamp < from || r.sample.stamp > to;
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

/// Reads the samples for the frames [request.start, …) of the sequence. Configured extrinsics
/// (`ins.lever_arm_m`, `ins.boresight_deg`) take precedence over the data set's.
/// `comparison.max_gap_ms` and `max_wait_ms` are at least 1.5 of the recording's usual interval.
/// Throws InputError as read_recorded_ins() and comparison_options() do.
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

/// Frames that cannot be read and are listed: 140 kB of events. A data set whose images are
/// elsewhere has a million.
constexpr std::uint64_t kMaxListed = 1000;

SourceEvent make_event(const DecodedPair& pair, std::uint64_t unread) noexcept {
  SourceEvent event{.record = {pair.stamp, pair.kind,
                               unread <= kMaxListed ? pair.issue.data()
                                                    : "1000 frames could not be read; further ones "
                                                      "are only counted (summary.json: skipped)"},
                    .skipped = true,
                    .listed = unread <= kMaxListed + 1};
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
      for (const std::string& message : *remarks) facts_.remarks.push_back({message, "data"});
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
        facts_.remarks.push_back({std::move(warning), "calibration"});
    }
    facts_.image_bytes = frames_arena_.used();
    facts_.ring_bytes = sizeof(FrameDecoder);
  }

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
    SourceFrame frame{.rig = {.number = pair_.frame, .stamp = pair_.stamp, .cameras = 2},
                      .decode_ms = pair_.decode_ms};
    for (std::size_t k = 0; k < 2; ++k) frame.rig.images[k] = pool_.view(pair_.slots[k]);
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

/// A word of calibrations.csv, which are constants.
const char* to_cause(const std::string& word) {
  for (const char* known : {"state_file", "whole_drive"})
    if (word == known) return known;
  return "given";
}

/// Initial calibration of a recorded session. Throws InputError if its description is damaged.
StartingCalibration recorded_beginning(const SessionDescription& d, const std::string& name) {
  return {.file = parse_calibration(d.calibration, name + " (calibration)"),
          .nominal = parse_calibration(d.nominal, name + " (nominal)").rig,
          .trust = d.trust,
          .cause = to_cause(d.cause),
          .source = d.source};
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
    const SessionDescription& d = session_.description();
    facts_.begin = other ? std::move(*other) : recorded_beginning(d, request.data.string());
    if (!other_) facts_.adoption = d.adoption;
    facts_.frames = end_ - next_frame_;
    facts_.first = session_.frames()[next_frame_].given.stamp;
    if (d.ins && !session_.readings().empty())
      facts_.ins = SourceIns{comparison_options(request.configuration), InsSource::recording,
                             d.mount_source, session_.readings().capacity() * sizeof(InsRecord)};
    for (const std::string& message : session_.remarks())
      facts_.remarks.push_back({message, "data"});
    if (!other_ && !session_.complete())
      facts_.remarks.push_back(
          {"the recording is incomplete: the poses differ from those of the run", "data"});
    const RigCalibration& rig = facts_.begin.file.rig;
    for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
      pixels_[k].resize(static_cast<std::size_t>(rig.intrinsics[k].width) *
                        static_cast<std::size_t>(rig.intrinsics[k].height));
      facts_.image_bytes += pixels_[k].size();
    }
    for (std::size_t i = next_frame_; i < end_; ++i) {
      const RecordedFrame& frame = session_.frames()[i];
      for (std::size_t k = 0; k < kMaxCameras; ++k) {
        const RecordedImage& image = frame.images[k];
        if (image.offset != 0 &&
            (k >= static_cast<std::size_t>(rig.cameras) || image.width != rig.intrinsics[k].width ||
             image.height != rig.intrinsics[k].height))
          throw InputError(
              "{}: frame {} of the recording: the image of camera {} has {} x {} pixels, unlike "
              "the calibration; use the calibration of this recording",
              request.data.string(), frame.given.number, k, image.width, image.height);
      }
    }
    // From the middle of a drive: what came before is not for it.
    if (next_frame_ > 0) next_reading_ = session_.frames()[next_frame_ - 1].readings;
  }

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
      *item = SourceEvent{.record = {frame.given.stamp, "recalibration_requested",
                                     "a recalibration was requested, as in the recorded run"},
                          .recalibrate = true};
      return true;
    }
    recalibration_reported_ = false;
    ++next_frame_;
    *item = load(frame);
    return true;
  }
  void stop() noexcept override { stopped_.store(true, std::memory_order_relaxed); }
  void finish(Progress* progress) override {
    if (images_missing_ > 0)
      progress->print(
          "vergence: {} images are damaged or missing in the recording; frames were processed "
          "without them",
          images_missing_);
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
    // Time-dependent decisions, which the estimator repeats.
    if (!other_) {
      frame.solver_idle = given.solver_done;
      frame.rig.effort = given.sample.effort;
    }
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
    reader_.start(TaskRef(read));
    reader_.wait();
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
  // Images of the current frame.
  std::array<std::vector<std::uint8_t>, kMaxCameras> pixels_;
  std::atomic<bool> stopped_{false};

  // Used by the estimator's thread; read by others after it has joined.
  std::size_t next_frame_ = 0, next_reading_ = 0;
  // True if the recalibration of the next frame was reported.
  bool recalibration_reported_ = false;
  std::uint64_t images_missing_ = 0;
  // Decoding allocates and therefore runs in its own thread.
  BackgroundThread reader_{BackgroundThread::Role::reader};
};

/// The truth that lies with the data set, for the stamps that its frames have; empty when there is
/// none.
Trajectory read_reference(const ReplayRequest& request, const StereoSequence& sequence) {
  // The layouts of these formats have no ground truth.
  if (request.format == SequenceFormat::kitti_raw || request.format == SequenceFormat::st_lucia ||
      is_bag(request.format) || request.format == SequenceFormat::session)
    return {};
  const std::filesystem::path truth = request.data / "truth.tum";
  std::error_code ignored;
  const auto file =
      request.format == SequenceFormat::folder && std::filesystem::exists(truth, ignored)
          ? std::optional(truth)
          : find_truth(request.data);
  if (!file) return {};
  std::vector<Stamp> times;
  times.reserve(sequence.pairs.size());
  for (const StereoPair& pair : sequence.pairs) times.push_back(pair.stamp);
  return read_trajectory_file(*file, {.times = times}).poses;
}

/// Replaces the initial calibration by one from the sequence itself; where nothing is found
/// that stays, and a warning gives the reason.
bool calibrate_first(const ReplayRequest& request, const SignalGuard& signals,
                     const StereoSequence& sequence, StartingCalibration* begin) {
  Progress progress = Progress::on_stderr(request.session.quiet);
  const DriveCalibration found = calibrate_with_progress(
      {sequence, request.configuration, request.start, request.count_of(sequence), {}}, *begin,
      signals, &progress);
  if (!found.rig) {
    progress.print("vergence: no calibration from the sequence: " + found.why);
    return false;
  }
  if (!request.session.quiet) progress.print(describe(found));
  begin->file.rig = *found.rig;
  begin->file.source = begin->source = "the sequence itself";
  begin->cause = "whole_drive";
  begin->trust = CalibrationTrust::given;
  return true;
}

/// Lenses are found from a beginning that is near enough. With nothing known about it: no
/// distortion, then that of a usual lens of 80 to 100 degrees.
void calibrate_unknown(ReplayRequest request, const SignalGuard& signals, StereoSequence* sequence,
                       StartingCalibration* begin) {
  if (calibrate_first(request, signals, *sequence, begin) || signals.stop_requested()) return;
  if (!request.known || request.known->model != CameraModelKind::pinhole_radtan) return;
  if (!request.session.quiet)
    fmt::print(stderr, "vergence: retrying with the initial distortion of a wide lens\n");
  request.known->wide = true;
  StereoSequence wide = open_drive(request);
  StartingCalibration other = replayed_calibration(request.configuration, wide, true);
  if (!calibrate_first(request, signals, wide, &other)) return;
  *sequence = std::move(wide);
  *begin = std::move(other);
}

/// Initial calibration of a recorded session, if requested to differ from the recorded one.
std::optional<StartingCalibration> other_beginning(const ReplayRequest& request,
                                                   const RecordedSession& session) {
  if (!request.calibration && !request.from_scratch && !request.baseline) return std::nullopt;
  const CalibrationUse use{request.from_scratch, request.baseline.value_or(0)};
  StartingCalibration begin = recorded_beginning(session.description(), request.data.string());
  if (request.calibration) {
    const Intrinsics& lens = begin.file.rig.intrinsics[0];
    const int recorded = begin.file.rig.cameras;
    begin.file = read_any_calibration(*request.calibration, ImageSize{lens.width, lens.height},
                                      &begin.remarks, use);
    if (begin.file.rig.cameras != recorded)
      throw InputError(
          "{}: has {} cameras, but {} was recorded with {}; use the calibration of that rig",
          *request.calibration, begin.file.rig.cameras, request.data.string(), recorded);
    begin.source = std::filesystem::path(*request.calibration).filename().string();
    for (const std::string& message : begin.remarks) fmt::print(stderr, "vergence: {}\n", message);
  } else {
    apply_use(use, &begin.file.rig);
  }
  begin.trust = request.from_scratch ? CalibrationTrust::none : CalibrationTrust::given;
  begin.cause = "given";
  if (request.from_scratch) begin.source = "none";
  begin.nominal =
      nominal_geometry(begin.file.rig, begin.file.rig, request.configuration.calibration);
  return begin;
}

void check_start(const ReplayRequest& request, std::size_t frames) {
  if (request.start >= frames)
    throw InputError("--start {} is beyond the end: {} has {} frames; choose a smaller index",
                     request.start, request.data.string(), frames);
}

ExitCode replay_recording(const ReplayRequest& request) {
  RecordedSession session = RecordedSession::open(request.data);
  check_start(request, session.frames().size());
  auto other = other_beginning(request, session);
  SessionSource source(request, std::move(session), std::move(other));
  const SignalGuard signals;
  return run_session(source, request.configuration, request.session, signals);
}

}  // namespace

StereoSequence open_drive(const ReplayRequest& request) {
  std::vector<std::string> remarks;
  SequenceOptions o{
      .use = {request.from_scratch || request.known, request.baseline.value_or(0)},
      .cameras = {request.configuration.kitti_raw.left, request.configuration.kitti_raw.right},
      .topics = request.topics};
  if (request.known) o.calibration = given_calibration(*request.known);
  if (request.calibration) o.calibration = given_calibration(*request.calibration, o.use, &remarks);
  StereoSequence sequence = open_sequence(request.format, request.data, o);
  for (const std::string& message : remarks) fmt::print(stderr, "vergence: {}\n", message);
  return sequence;
}

std::vector<std::string> recorded_settings(const std::filesystem::path& session) {
  // Settings that affect poses; those of the simulated rig and the recording stay as recorded.
  constexpr std::array kept{"odometry.",        "calibration.",       "monitor.", "comparison.",
                            "ins.lever_arm_m.", "ins.boresight_deg.", "rig.name="};
  std::vector<std::string> settings = RecordedSession::open(session).description().settings;
  std::erase_if(settings, [&](const std::string& s) {
    const bool mask = s.starts_with("cameras.") && s.find(".mask=") != std::string::npos;
    return !mask &&
           std::ranges::none_of(kept, [&](const char* group) { return s.starts_with(group); });
  });
  return settings;
}

ExitCode run_replay(const ReplayRequest& request) {
  // With another calibration a recorded session is a sequence of images like any other.
  if (request.format == SequenceFormat::session && !request.calibrate_first && !request.known)
    return replay_recording(request);
  StereoSequence sequence = open_drive(request);
  check_start(request, sequence.pairs.size());
  check_image_sizes(sequence, request.start, request.frames.value_or(sequence.pairs.size()));
  StartingCalibration begin =
      replayed_calibration(request.configuration, sequence, request.from_scratch || request.known);
  Trajectory truth = read_reference(request, sequence);
  ReplayedIns ins = replayed_ins(request, sequence);
  // One for both: who stops the calibration does not want the drive.
  const SignalGuard signals;
  if (request.calibrate_first) calibrate_unknown(request, signals, &sequence, &begin);
  if (const auto stopped = signals.stop_code()) return *stopped;
  RecordedSource source(request, std::move(sequence), std::move(begin), std::move(truth),
                        std::move(ins));
  return run_session(source, request.configuration, request.session, signals);
}

}  // namespace vergence::app
