#include "app/commands/replay_session.hpp"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "app/commands/camera_masks.hpp"
#include "app/commands/drive_calibration.hpp"
#include "app/commands/event_log.hpp"
#include "app/commands/ins_comparison.hpp"
#include "app/commands/replayed_ins.hpp"
#include "app/commands/session_files.hpp"
#include "app/commands/starting_calibration.hpp"
#include "app/datasets/frame_decoder.hpp"
#include "app/datasets/reference_track.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "app/recorder/recorder.hpp"
#include "app/recorder/summary.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/runtime/progress.hpp"
#include "app/runtime/signals.hpp"
#include "core/estimator/estimator.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

/// Everything that is set up before the first frame and torn down after the last, in the order of
/// its members.
class Replay {
 public:
  Replay(const ReplayRequest& request, StereoSequence sequence, StartingCalibration begin,
         Trajectory truth, ReplayedIns ins);

  [[nodiscard]] ExitCode run();

 private:
  void estimate() noexcept;
  void handle(const DecodedPair& pair) noexcept;
  void give_readings(Stamp until) noexcept;
  void compare(const PoseSample& sample, float decode_ms) noexcept;
  void watch(const SignalGuard& signals, Progress* progress);
  [[nodiscard]] SummaryInput summary_input(const SessionTotals& totals,
                                           std::uint64_t allocations) const;
  void tell(const SessionTotals& totals, const SummaryInput& input, Progress* progress) const;
  void tell_earth(const EarthFigures& earth, Progress* progress) const;
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory() const;

  const ReplayRequest& request_;
  const StereoSequence sequence_;
  const StartingCalibration begin_;
  const Trajectory truth_;
  const ReferenceTrack reference_;
  const ReplayedIns ins_;
  const std::size_t count_;  // frames of this replay
  const CameraMasks masks_;
  const EstimatorOptions options_;
  Arena frames_arena_, estimator_arena_, comparison_arena_;
  FramePool pool_;
  std::unique_ptr<PairRunner> runner_;
  BackgroundThread solver_;
  std::unique_ptr<Estimator> estimator_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<FrameDecoder> decoder_;

  // Of the estimator's thread; read by others after it has joined.
  EventLog journal_;
  std::unique_ptr<InsComparison> comparison_;  // null: no INS was recorded
  std::size_t next_reading_ = 0;
  std::uint64_t skipped_ = 0;

  std::mutex mutex_;  // with done_, for the caller's thread that waits
  std::condition_variable changed_;
  bool done_ = false;
};

int width_of(const StereoSequence& s) { return s.calibration.intrinsics[0].width; }
int height_of(const StereoSequence& s) { return s.calibration.intrinsics[0].height; }

Replay::Replay(const ReplayRequest& request, StereoSequence sequence, StartingCalibration begin,
               Trajectory truth, ReplayedIns ins)
    : request_(request),
      sequence_(std::move(sequence)),
      begin_(std::move(begin)),
      truth_(std::move(truth)),
      reference_(truth_),
      ins_(std::move(ins)),
      count_(std::min(request.frames.value_or(sequence_.pairs.size()),
                      sequence_.pairs.size() - request.start)),
      masks_(request.configuration, begin_.file.rig),
      options_(estimator_options(request.configuration, begin_.trust, Adoption::after_fixed_frames,
                                 masks_.views())),
      frames_arena_(arena_size(FramePool::memory_needed(width_of(sequence_), height_of(sequence_),
                                                        FrameDecoder::kSlots))),
      estimator_arena_(arena_size(Estimator::memory_needed(options_, begin_.file.rig))),
      comparison_arena_(
          arena_size(ins_.readings.empty() ? 0 : Comparison::bytes_needed(ins_.options))),
      pool_(width_of(sequence_), height_of(sequence_), FrameDecoder::kSlots, frames_arena_),
      runner_(make_runner(request.configuration.threads)),
      estimator_(std::make_unique<Estimator>(options_, begin_.file.rig, begin_.nominal,
                                             estimator_arena_, *runner_, solver_)),
      skipped_(sequence_.left_out) {
  if (ins_.readings.empty()) return;
  comparison_ = std::make_unique<InsComparison>(ins_.options, InsComparison::Source::recording,
                                                comparison_arena_, journal_);
}

void Replay::estimate() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-estim");
  AllocationGuard::seal_thread();
  for (DecodedPair pair; decoder_->next(&pair);) {
    handle(pair);
    decoder_->release(pair);
  }
  estimator_->finish();
  journal_.note(*estimator_);
  if (comparison_) {
    give_readings(Stamp(std::numeric_limits<std::int64_t>::max()));
    comparison_->finish();
  }
  AllocationGuard::unseal_thread();
  const std::lock_guard lock(mutex_);
  done_ = true;
  changed_.notify_one();
}

void Replay::handle(const DecodedPair& pair) noexcept {
  if (!pair.decoded) {
    ++skipped_;
    journal_.note_skipped();
    EventRecord event;
    event.stamp = pair.stamp;
    event.kind = pair.kind;
    event.set_sentence(pair.note.data());
    event.fields[0] = {"frame", static_cast<std::int64_t>(pair.frame)};
    recorder_->post(event);
    return;
  }
  RigFrame frame;
  frame.number = pair.frame;
  frame.stamp = pair.stamp;
  frame.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k) frame.images[k] = pool_.view(pair.slots[k]);
  const PoseSample sample = estimator_->process(frame);
  journal_.note(*estimator_);
  journal_.note(sample);
  compare(sample, pair.decode_ms);
}

void Replay::give_readings(Stamp until) noexcept {
  for (; next_reading_ < ins_.readings.size() && ins_.readings[next_reading_].sample.stamp <= until;
       ++next_reading_) {
    comparison_->add({ins_.readings[next_reading_].sample, ins_.readings[next_reading_].quality});
    comparison_->drain();
  }
}

void Replay::compare(const PoseSample& sample, float decode_ms) noexcept {
  if (!comparison_) {
    recorder_->post(PoseRecord::of(sample, decode_ms, reference_.at(sample.stamp)));
    return;
  }
  give_readings(sample.stamp);
  comparison_->add(sample, decode_ms);
  comparison_->drain();
}

void Replay::watch(const SignalGuard& signals, Progress* progress) {
  constexpr std::chrono::milliseconds kLook{50};
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLook, [this] { return done_; })) {
    if (signals.stop_requested()) decoder_->stop();
    lock.unlock();
    journal_.show(progress, count_);
    lock.lock();
  }
  lock.unlock();
  journal_.show(progress, count_);
}

SummaryInput Replay::summary_input(const SessionTotals& totals, std::uint64_t allocations) const {
  SummaryInput input;
  input.skipped = skipped_;
  input.dropped_by_estimator = journal_.dropped();
  const Trajectory& reference = comparison_ ? totals.reference : truth_;
  if (!reference.empty() && !totals.trajectory.empty())
    input.evaluation = evaluate(totals.trajectory, reference, summary_evaluation_options());
  if (comparison_) {
    input.comparison = comparison_->counters();
    input.earth = comparison_->earth(ins_.mount_source);
  }
  describe_calibration(*estimator_, begin_, totals, options_, journal_.matches(), &input);
  input.allocations_after_seal = allocations;
  input.memory = memory();
  input.configuration_hash = configuration_hash(request_.configuration);
  return input;
}

std::vector<std::pair<std::string, std::size_t>> Replay::memory() const {
  return {{"estimator_bytes", estimator_arena_.capacity()},
          {"comparison_bytes",
           comparison_arena_.capacity() + ins_.readings.capacity() * sizeof(RecordedReading)},
          {"images_bytes", frames_arena_.capacity()},
          {"rings_bytes", sizeof(Recorder) + sizeof(FrameDecoder) + sizeof(EventLog)}};
}

void Replay::tell(const SessionTotals& totals, const SummaryInput& input,
                  Progress* progress) const {
  const std::uint64_t posed = totals.ok + totals.degraded;
  progress->say(
      fmt::format("session {}: {} frames, {} posed ({} degraded), {} lost, {} skipped; {:.2f} m; "
                  "{:.1f} ms a frame, {:.1f} at p99",
                  request_.out.string(), totals.read, posed, totals.degraded, totals.lost, skipped_,
                  totals.path_m, totals.estimate.mean(), totals.estimate.percentile(0.99)));
  if (const std::string sentence = verification_sentence(input); !sentence.empty())
    progress->say(sentence);
  if (input.evaluation && input.evaluation->status == EvaluationStatus::ok) {
    const TrajectoryEvaluation& e = *input.evaluation;
    const SegmentErrors& near = e.segments[1];
    const std::string segments =
        near.count > 0 ? fmt::format("; segments of 10 to 50 m {:.2f} %", 100 * near.translation)
                       : "";
    progress->say(fmt::format(
        "against the reference over {:.2f} m: ATE {:.4f} m, {:.4f} m after a scale of {:.4f}{}",
        e.path_reference, e.ate_se3.rmse, e.ate_sim3.rmse, e.sim3.scale, segments));
    if (!comparison_)
      progress->say(fmt::format("next: vergence evaluate {} {}",
                                (request_.out / "trajectory.tum").string(),
                                request_.data.string()));
  } else if (!comparison_) {
    progress->say(
        fmt::format("there is no reference to compare with; next: vergence evaluate {} REFERENCE",
                    (request_.out / "trajectory.tum").string()));
  }
  if (comparison_) tell_earth(*input.earth, progress);
}

void Replay::tell_earth(const EarthFigures& earth, Progress* progress) const {
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
                    request_.configuration.comparison.placement_m));
}

ExitCode Replay::run() {
  const SignalGuard signals;
  make_session_folder(request_.out);
  Recorder::Options to_record;
  to_record.expected_frames = count_;
  to_record.ins = comparison_ != nullptr;
  to_record.keep = calibration_keeper(request_.out, begin_.file, std::nullopt);
  recorder_ = std::make_unique<Recorder>(request_.out, to_record);
  const Stamp first = sequence_.pairs[request_.start].stamp;
  journal_.open(recorder_.get(), first);
  if (comparison_) comparison_->open(recorder_.get());
  std::vector<std::string> faults;
  begin_session(request_.out, begin_, first, recorder_.get(), &faults);
  if (request_.print_memory) print_memory_table(memory());

  Progress progress = Progress::on_stderr(request_.quiet);
  for (const std::vector<std::string>* remarks : {&sequence_.remarks, &ins_.remarks})
    for (const std::string& sentence : *remarks) {
      if (!request_.quiet) progress.say("vergence: " + sentence);
      journal_.tell(first, "data", sentence, false);
    }
  decoder_ = std::make_unique<FrameDecoder>(sequence_, request_.start, count_, pool_);
  const auto allocations_before = AllocationGuard::allocations_after_seal();
  std::thread estimating([this] { estimate(); });
  watch(signals, &progress);
  estimating.join();
  decoder_.reset();
  progress.finish();

  const auto totals = recorder_->close();
  const SummaryInput input =
      summary_input(*totals, AllocationGuard::allocations_after_seal() - allocations_before);
  if (faults.empty())
    end_session(request_.out, begin_, input, *totals, journal_.matches(), &faults);
  write_session_summary(request_.out, *totals, input, &faults);
  faults.insert(faults.end(), totals->faults.begin(), totals->faults.end());
  for (const std::string& sentence : write_other_formats(
           request_.out, request_.also, *totals, input.earth.value_or(EarthFigures{}), &faults))
    progress.say("vergence: " + sentence);
  for (const std::string& sentence : recorder_->take_errors())
    progress.say("vergence: " + sentence);
  for (const std::string& sentence : faults) progress.say("vergence: " + sentence);
  if (!request_.quiet) tell(*totals, input, &progress);
  const bool usable = write_session_report(request_.out, request_.quiet, &progress);

  if (const auto stopped = signals.stop_code()) return *stopped;
  if (totals->ok + totals->degraded == 0) {
    progress.say("vergence: there never was a pose; events.jsonl and poses.csv in " +
                 request_.out.string() + " say why");
    return ExitCode::not_usable;
  }
  if (comparison_ && comparison_->matches() == 0) {
    progress.say(
        "vergence: the INS never had a position for a frame: nothing is compared; the poses are "
        "there");
    return ExitCode::not_usable;
  }
  return usable && faults.empty() ? ExitCode::done : ExitCode::not_usable;
}

/// The truth that lies with the data set, for the stamps that its frames have; empty when there is
/// none.
Trajectory read_reference(const ReplayRequest& request, const StereoSequence& sequence) {
  if (request.format == SequenceFormat::kitti_raw || request.format == SequenceFormat::st_lucia ||
      request.format == SequenceFormat::mcap)
    return {};  // their layouts have no truth
  const bool plain = request.format == SequenceFormat::folder;
  std::error_code ignored;
  if (plain && std::filesystem::exists(request.data / "truth.tum", ignored))
    return read_tum(request.data / "truth.tum");
  if (plain && !std::filesystem::exists(request.data / "poses.txt", ignored)) return {};
  const auto files =
      plain ? std::optional(TruthFiles{TruthFiles::Kind::kitti, request.data / "poses.txt", {}})
            : find_truth(request.data);
  if (!files) return {};
  if (files->kind != TruthFiles::Kind::kitti) return read_truth(*files);
  std::vector<Stamp> times;
  times.reserve(sequence.pairs.size());
  for (const StereoPair& pair : sequence.pairs) times.push_back(pair.stamp);
  return read_kitti(files->poses, times);
}

/// The drive, with the calibration that the user names, if any; remarks are said.
StereoSequence open_drive(const ReplayRequest& request) {
  const CalibrationUse use{request.from_scratch || request.known, request.baseline.value_or(0)};
  const std::array cameras{request.configuration.kitti_raw.left,
                           request.configuration.kitti_raw.right};
  std::vector<std::string> remarks;
  StereoSequence sequence;
  if (request.known)
    sequence = open_sequence(request.format, request.data, given_calibration(*request.known), use,
                             cameras, request.topics);
  else if (request.calibration)
    sequence = open_sequence(request.format, request.data,
                             given_calibration(*request.calibration, use, &remarks), use, cameras,
                             request.topics);
  else
    sequence =
        open_sequence(request.format, request.data, std::nullopt, use, cameras, request.topics);
  if (!request.quiet)
    for (const std::string& sentence : remarks) fmt::print(stderr, "vergence: {}\n", sentence);
  return sequence;
}

/// What the drive itself says of its rig, in the place of what it came with; where nothing is found
/// that stays, and the user hears why.
bool calibrate_first(const ReplayRequest& request, const StereoSequence& sequence,
                     StartingCalibration* begin) {
  Progress progress = Progress::on_stderr(request.quiet);
  const std::size_t count = std::min(request.frames.value_or(sequence.pairs.size()),
                                     sequence.pairs.size() - request.start);
  const DriveCalibration found = calibrate_with_progress(
      {sequence, request.configuration, request.start, count, {}, {}}, *begin, &progress);
  if (!found.rig) {
    progress.say("vergence: the drive gives no calibration: " + found.why);
    return false;
  }
  if (!request.quiet) progress.say(describe(found));
  begin->file.rig = *found.rig;
  begin->file.source = begin->source = "the drive itself";
  begin->cause = "whole_drive";
  begin->trust = CalibrationTrust::given;
  return true;
}

/// Lenses are found from a beginning that is near enough. Of one that nobody knows anything of: no
/// distortion, then that of a usual lens of 80 to 100 degrees.
void calibrate_unknown(ReplayRequest request, StereoSequence* sequence,
                       StartingCalibration* begin) {
  if (calibrate_first(request, *sequence, begin)) return;
  if (!request.known || !request.known->distortion.empty() ||
      request.known->model != CameraModelKind::pinhole_radtan)
    return;
  if (!request.quiet)
    fmt::print(stderr, "vergence: once more, with the distortion of a wide lens to begin with\n");
  request.known->distortion = {-0.28, 0.07, 0, 0};
  StereoSequence wide = open_drive(request);
  StartingCalibration other = replayed_calibration(request.configuration, wide, true);
  if (!calibrate_first(request, wide, &other)) return;
  *sequence = std::move(wide);
  *begin = std::move(other);
}

}  // namespace

ExitCode run_replay(const ReplayRequest& request) {
  StereoSequence sequence = open_drive(request);
  if (request.start >= sequence.pairs.size())
    throw InputError(fmt::format("--start {} is beyond the drive: {} has {} frames", request.start,
                                 request.data.string(), sequence.pairs.size()));
  check_image_sizes(sequence, request.start, request.frames.value_or(sequence.pairs.size()));
  StartingCalibration begin =
      replayed_calibration(request.configuration, sequence, request.from_scratch || request.known);
  Trajectory truth = read_reference(request, sequence);
  ReplayedIns ins = replayed_ins(request, sequence);
  if (request.calibrate_first) calibrate_unknown(request, &sequence, &begin);
  std::unique_ptr<Replay> replay;
  try {
    replay = std::make_unique<Replay>(request, std::move(sequence), std::move(begin),
                                      std::move(truth), std::move(ins));
  } catch (const std::invalid_argument& e) {  // options and rig do not go together
    throw InputError(e.what());
  } catch (const std::length_error& e) {
    throw InputError(e.what());
  }
  return replay->run();
}

}  // namespace vergence::app
