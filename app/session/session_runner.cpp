#include "app/session/session_runner.hpp"

#include <malloc.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "app/datasets/reference_track.hpp"
#include "app/devices/camera_masks.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/runtime/service_manager.hpp"
#include "app/session/drive_recorder.hpp"
#include "app/session/drive_threads.hpp"
#include "app/session/event_log.hpp"
#include "app/session/ins_comparison.hpp"
#include "app/session/memory_figures.hpp"
#include "app/session/session_files.hpp"
#include "app/session/session_output.hpp"
#include "app/session/session_quota.hpp"
#include "app/session/solver_watch.hpp"
#include "core/estimator/estimator.hpp"
#include "core/memory/allocation_guard.hpp"
#include "core/memory/thread_allocations.hpp"

namespace vergence::app {
namespace {

/// Everything that is set up before the first frame and torn down after the last, in the order of
/// its members.
class SessionRunner {
 public:
  SessionRunner(FrameSource& source, const Configuration& configuration,
                const SessionOptions& options, const SignalGuard& signals);
  [[nodiscard]] ExitCode run();

 private:
  void open(std::vector<std::string>* faults);
  [[nodiscard]] SessionStart session_start() const;
  void say_remarks(Progress* progress);
  void estimate() noexcept;
  void handle(const SourceFrame& frame) noexcept;
  void handle(const InsRecord& reading) noexcept { comparison_->add(reading); }
  void handle(const SourceEvent& event) noexcept;
  void compare(const PoseSample& sample, float decode_ms) noexcept;
  void request_recalibration(Stamp stamp, const char* sentence) noexcept;
  void take_requests(Stamp stamp) noexcept;
  void watch(Progress* progress);
  void say_recording_errors(Progress* progress);
  [[nodiscard]] SummaryInput summary_input(const SessionTotals& totals,
                                           std::uint64_t allocations) const;
  void write_files(const SessionTotals& totals, const SummaryInput& input,
                   std::vector<std::string>* faults, Progress* progress);
  void print_figures(const SessionTotals& totals, const SummaryInput& input,
                     Progress* progress) const;
  [[nodiscard]] ExitCode verdict(const SessionTotals& totals,
                                 const std::vector<std::string>& faults, Progress* progress) const;
  [[nodiscard]] std::vector<MemoryRow> memory() const;

  FrameSource& source_;
  const SourceFacts& facts_;
  const Configuration& configuration_;
  const SessionOptions& request_;
  const SignalGuard& signals_;
  const ReferenceTrack reference_;
  const CameraMasks masks_;
  const EstimatorOptions options_;
  Arena estimator_arena_, comparison_arena_;
  std::unique_ptr<PairRunner> runner_;
  BackgroundThread solver_;
  SolverWatch watched_solver_{solver_};
  std::unique_ptr<Estimator> estimator_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<DriveRecorder> recording_;  // null: nothing is recorded
  std::vector<SessionObserver*> observers_;
  std::vector<std::string> removed_;  // sessions over the quota: a sentence each

  // Of the estimator's thread; read by others after it has joined.
  SessionOutput output_;
  EventLog journal_;
  std::unique_ptr<InsComparison> comparison_;  // null: there is no INS

  std::atomic<bool> calibration_asked_{false};  // by the caller's thread, for the estimator's
  std::atomic<std::uint64_t> beats_{0};         // items that the estimator's thread has handled
  ServiceManager service_;                      // of the caller's thread
  std::mutex mutex_;                            // with done_, for the caller's thread that waits
  std::condition_variable changed_;
  bool done_ = false;
  ResidentMemory resident_{};  // at the drive's end
  bool delivering_ = false;    // of the estimator's thread: a frame has come
  DriveThreads threads_;       // of the caller's thread
};

namespace {

/// What a frame may take: in a live drive the next one does not wait.
Duration frame_budget(const SourceFacts& facts, const RealtimeSettings& realtime) noexcept {
  if (facts.frame_interval <= Duration{}) return {};
  return realtime.frame_budget_ms > 0 ? Duration::seconds(1e-3 * realtime.frame_budget_ms)
                                      : facts.frame_interval;
}

}  // namespace

SessionRunner::SessionRunner(FrameSource& source, const Configuration& configuration,
                             const SessionOptions& options, const SignalGuard& signals)
    : source_(source),
      facts_(source.facts()),
      configuration_(configuration),
      request_(options),
      signals_(signals),
      reference_(facts_.truth),
      masks_(configuration, facts_.begin.file.rig),
      options_(estimator_options(configuration, facts_.begin.trust, facts_.adoption, masks_.views(),
                                 frame_budget(facts_, configuration.realtime))),
      estimator_arena_(arena_size(Estimator::memory_needed(options_, facts_.begin.file.rig))),
      comparison_arena_(arena_size(facts_.ins ? Comparison::bytes_needed(facts_.ins->options) : 0)),
      runner_(make_runner(configuration.threads)),
      estimator_(std::make_unique<Estimator>(options_, facts_.begin.file.rig, facts_.begin.nominal,
                                             estimator_arena_, *runner_, watched_solver_)),
      threads_(configuration.realtime) {
  if (facts_.ins)
    comparison_ = std::make_unique<InsComparison>(facts_.ins->options, facts_.ins->kind,
                                                  comparison_arena_, journal_);
}

// ---- the estimator's thread

void SessionRunner::estimate() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-estim");
  AllocationGuard::seal_thread();
  for (SourceItem item; source_.next(&item);) {
    beats_.fetch_add(1, std::memory_order_relaxed);
    if (const auto* frame = std::get_if<SourceFrame>(&item)) handle(*frame);
    if (const auto* reading = std::get_if<InsRecord>(&item)) handle(*reading);
    if (const auto* event = std::get_if<SourceEvent>(&item)) handle(*event);
    if (comparison_) comparison_->drain();
  }
  ThreadAllocations::end();
  estimator_->finish();
  journal_.note(*estimator_);
  if (comparison_) comparison_->finish();
  AllocationGuard::unseal_thread();
  const std::lock_guard lock(mutex_);
  done_ = true;
  changed_.notify_one();
}

void SessionRunner::handle(const SourceEvent& event) noexcept {
  if (event.recalibrate) estimator_->request_recalibration();
  if (event.skipped) journal_.note_skipped();
  if (event.listed) journal_.tell(event.record, event.to_user);
}

void SessionRunner::request_recalibration(Stamp stamp, const char* sentence) noexcept {
  estimator_->request_recalibration();
  journal_.tell(stamp, "recalibration_requested", sentence, true);
}

/// What viewers of the session have asked for.
void SessionRunner::take_requests(Stamp stamp) noexcept {
  SessionRequests* requests = request_.requests;
  if (requests == nullptr) return;
  constexpr auto kOrder = std::memory_order_relaxed;
  if (requests->recalibrate.exchange(false, kOrder) && facts_.on_request)
    request_recalibration(stamp, "a new calibration was asked for on the live page");
  if (requests->mark.exchange(false, kOrder))
    journal_.tell(stamp, "mark", "marked on the live page", true);
  if (requests->stop_recording.exchange(false, kOrder) && recording_) {
    journal_.tell(stamp, "recording_stopped",
                  "drive.mcap ends here, as asked for on the live page; the drive goes on", true);
    recording_->stop();
  }
}

void SessionRunner::handle(const SourceFrame& frame) noexcept {
  if (calibration_asked_.exchange(false, std::memory_order_relaxed))
    request_recalibration(frame.rig.stamp, "a new calibration was asked for by SIGUSR1");
  take_requests(frame.rig.stamp);
  if (!delivering_) ThreadAllocations::begin();
  delivering_ = true;
  watched_solver_.begin_frame(frame.solver_idle);
  output_.post(frame.rig);
  const PoseSample sample = estimator_->process(frame.rig);
  source_.done(sample);
  output_.post(sample);
  output_.post(estimator_->tracks());
  journal_.note(*estimator_);
  journal_.note(sample);
  compare(sample, frame.decode_ms);
}

void SessionRunner::compare(const PoseSample& sample, float decode_ms) noexcept {
  if (comparison_)
    comparison_->add(sample, decode_ms);
  else
    output_.post(PoseRecord::of(sample, decode_ms, reference_.at(sample.stamp)));
}

// ---- the caller's thread

void SessionRunner::watch(Progress* progress) {
  constexpr std::chrono::milliseconds kLook{50};
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLook, [this] { return done_; })) {
    if (signals_.stop_requested()) source_.stop();
    source_.look();
    service_.alive(beats_.load(std::memory_order_relaxed), std::chrono::steady_clock::now());
    if (facts_.on_request && signals_.take_calibration_request())
      calibration_asked_.store(true, std::memory_order_relaxed);
    lock.unlock();
    if (signals_.take_reopen_request()) {
      recorder_->reopen();
      if (recording_) recording_->roll();
    }
    threads_.look(progress);
    journal_.show(progress, facts_.frames);
    say_recording_errors(progress);
    lock.lock();
  }
  lock.unlock();
  journal_.show(progress, facts_.frames);
}

void SessionRunner::say_recording_errors(Progress* progress) {
  if (!recording_) return;
  for (const std::string& sentence : recording_->take_errors())
    progress->say("vergence: " + sentence);
}

void SessionRunner::open(std::vector<std::string>* faults) {
  make_session_folder(request_.out);
  if (const int quota_mb = configuration_.sessions.quota_mb; quota_mb > 0)
    removed_ = keep_session_quota(request_.out, static_cast<std::uint64_t>(quota_mb) * 1'000'000);
  Recorder::Options to_record;
  to_record.when_full = facts_.when_full;
  to_record.expected_frames = facts_.expected_frames;
  to_record.ins = comparison_ != nullptr;
  to_record.keep = calibration_keeper(request_.out, facts_.begin.file, facts_.begin.state);
  to_record.disk_full = facts_.disk_full;
  recorder_ = std::make_unique<Recorder>(request_.out, to_record);
  observers_ = request_.observers;
  if (configuration_.record.any()) {
    recording_ =
        std::make_unique<DriveRecorder>(request_.out, configuration_, facts_, watched_solver_);
    observers_.push_back(recording_.get());
  }
  output_ = SessionOutput(recorder_.get(), observers_);
  const SessionStart start = session_start();
  for (SessionObserver* observer : observers_) observer->on_start(start);
  journal_.open(&output_, facts_.first);
  if (comparison_) comparison_->open(&output_);
  begin_session(request_.out, facts_.begin, facts_.first, &output_, faults);
}

SessionStart SessionRunner::session_start() const {
  SessionStart start;
  start.name = request_.out.filename().string();
  start.first = facts_.first;
  start.frames = facts_.frames;
  start.tie = facts_.tie;
  const RigCalibration& rig = facts_.begin.file.rig;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    start.image_bytes =
        std::max(start.image_bytes, static_cast<std::size_t>(rig.intrinsics[k].width) *
                                        static_cast<std::size_t>(rig.intrinsics[k].height));
  start.can_recalibrate = facts_.on_request;
  start.recording = recording_ != nullptr;
  return start;
}

void SessionRunner::say_remarks(Progress* progress) {
  for (const std::string& sentence : removed_) {
    progress->say("vergence: " + sentence);
    journal_.tell(facts_.first, "session_removed", sentence, false);
  }
  for (const SourceRemark& remark : facts_.remarks) {
    if (remark.say) progress->say("vergence: " + remark.sentence);
    if (remark.kind != nullptr) journal_.tell(facts_.first, remark.kind, remark.sentence, false);
  }
}

std::vector<MemoryRow> SessionRunner::memory() const {
  return {{"estimator_bytes", estimator_arena_.capacity(), estimator_arena_.rows()},
          {"comparison_bytes",
           comparison_arena_.capacity() + (facts_.ins ? facts_.ins->reading_bytes : 0)},
          {"images_bytes", facts_.image_bytes},
          {"recording_bytes", recording_ ? recording_->memory() : 0},
          {"recorder_bytes", recorder_ ? recorder_->memory() : 0},
          {"rings_bytes", sizeof(Recorder) + sizeof(EventLog) + facts_.ring_bytes}};
}

SummaryInput SessionRunner::summary_input(const SessionTotals& totals,
                                          std::uint64_t allocations) const {
  SummaryInput input;
  input.dropped_by_estimator = journal_.dropped();
  const Trajectory& reference = comparison_ ? totals.reference : facts_.truth;
  if (!reference.empty() && !totals.trajectory.empty())
    input.evaluation = evaluate(totals.trajectory, reference, summary_evaluation_options());
  if (comparison_) {
    input.comparison = comparison_->counters();
    input.earth = comparison_->earth(facts_.ins->mount_source);
  }
  describe_calibration(*estimator_, facts_.begin, totals, options_, journal_.matches(), &input);
  input.allocations_after_seal = allocations;
  input.frame_budget = options_.frame_budget;
  input.allocations = threads_.figures();
  for (const MemoryRow& row : memory()) input.memory.emplace_back(row.name, row.bytes);
  input.resident = named(resident_);
  input.configuration_hash = configuration_hash(configuration_);
  source_.describe(totals, *estimator_, &input);
  for (SessionObserver* observer : observers_)
    for (auto& counter : observer->counters()) input.devices.push_back(std::move(counter));
  return input;
}

void SessionRunner::write_files(const SessionTotals& totals, const SummaryInput& input,
                                std::vector<std::string>* faults, Progress* progress) {
  if (faults->empty())
    end_session(request_.out, facts_.begin, input, totals, journal_.matches(), faults);
  write_session_summary(request_.out, totals, input, faults);
  faults->insert(faults->end(), totals.faults.begin(), totals.faults.end());
  for (const std::string& sentence : write_other_formats(
           request_.out, request_.also, totals, input.earth.value_or(EarthFigures{}), faults))
    progress->say("vergence: " + sentence);
  for (const std::string& sentence : recorder_->take_errors())
    progress->say("vergence: " + sentence);
  for (const std::string& sentence : *faults) progress->say("vergence: " + sentence);
}

void SessionRunner::print_figures(const SessionTotals& totals, const SummaryInput& input,
                                  Progress* progress) const {
  progress->say(fmt::format(
      "session {}: {} frames, {} posed ({} degraded), {} lost, {} {}; {:.2f} m; {:.1f} ms a "
      "frame, {:.1f} at p99",
      request_.out.string(), totals.read, totals.ok + totals.degraded, totals.degraded, totals.lost,
      input.skipped, facts_.word_of_skipped, totals.path_m, totals.estimate.mean(),
      totals.estimate.percentile(0.99)));
  if (const std::string sentence = verification_sentence(input); !sentence.empty())
    progress->say(sentence);
  if (const std::string sentence = allocations_sentence(input.allocations); !sentence.empty())
    progress->say(sentence);
  source_.print_figures(totals, input, progress);
}

ExitCode SessionRunner::verdict(const SessionTotals& totals, const std::vector<std::string>& faults,
                                Progress* progress) const {
  if (totals.ok + totals.degraded == 0) {
    progress->say("vergence: there never was a pose; events.jsonl and poses.csv in " +
                  request_.out.string() + " say why");
    return ExitCode::not_usable;
  }
  if (const auto code = source_.verdict(progress)) return *code;
  if (comparison_ && comparison_->matches() == 0) {
    progress->say(
        "vergence: the INS never had a position for a frame: nothing is compared; the poses are "
        "there");
    return ExitCode::not_usable;
  }
  return faults.empty() ? ExitCode::done : ExitCode::not_written;
}

ExitCode SessionRunner::run() {
  std::vector<std::string> faults;
  open(&faults);
  if (request_.print_memory) print_memory_table(memory());
  Progress progress = Progress::on_stderr(request_.quiet);
  const auto allocations_before = AllocationGuard::allocations_after_seal();
  say_remarks(&progress);
  (void)::malloc_trim(0);  // what setting up took and gave back goes to the system
  threads_.lock_memory(&progress);
  source_.start(&faults);
  std::thread estimating([this] { estimate(); });
  service_.ready();
  watch(&progress);
  service_.stopping();
  estimating.join();
  resident_ = resident_memory(
      {{"estimator_bytes", &estimator_arena_}, {"comparison_bytes", &comparison_arena_}});
  progress.finish();
  if (request_.print_memory) print_memory_table(resident_);
  source_.finish(&progress, &faults);

  if (recording_) recording_->close();
  say_recording_errors(&progress);
  const auto totals = recorder_->close();
  const SummaryInput input =
      summary_input(*totals, AllocationGuard::allocations_after_seal() - allocations_before);
  write_files(*totals, input, &faults, &progress);
  if (!request_.quiet) print_figures(*totals, input, &progress);
  const SessionReport report = write_session_report(request_.out);
  ExitCode code = verdict(*totals, faults, &progress);
  if (code == ExitCode::done && !report.outcome.usable) code = ExitCode::not_usable;
  say_verdict(report, request_.quiet, &progress);
  return signals_.stop_code().value_or(code);
}

}  // namespace

ExitCode run_session(FrameSource& source, const Configuration& configuration,
                     const SessionOptions& options, const SignalGuard& signals) {
  const auto runner = in_words(
      [&] { return std::make_unique<SessionRunner>(source, configuration, options, signals); });
  return runner->run();
}

}  // namespace vergence::app
