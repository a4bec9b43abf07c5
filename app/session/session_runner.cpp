#include "app/session/session_runner.hpp"

#include <malloc.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/datasets/reference_track.hpp"
#include "app/devices/camera_masks.hpp"
#include "app/report/report.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/realtime.hpp"
#include "app/runtime/service_manager.hpp"
#include "app/runtime/terminal_text.hpp"
#include "app/session/calibration_writer.hpp"
#include "app/session/drive_recorder.hpp"
#include "app/session/event_log.hpp"
#include "core/memory/allocation_guard.hpp"
#include "core/memory/arena.hpp"
#include "core/memory/thread_allocations.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

void print(const std::vector<std::string>& messages, Progress* progress) {
  for (const std::string& message : messages) progress->print("vergence: " + message);
}

/// Bytes taken by one holder, an arena's with what it holds by name.
struct MemoryRow {
  std::string name{};
  std::size_t bytes = 0;
  std::span<const ArenaRow> parts{};
};

void print_row(std::string_view name, std::size_t bytes) {
  fmt::print("{:<44}{:>14}\n", name, bytes);
}

/// Parts of an arena, the largest first; those below a hundredth in one line.
void print_parts(const MemoryRow& row) {
  std::vector<ArenaRow> parts(row.parts.begin(), row.parts.end());
  std::stable_sort(parts.begin(), parts.end(),
                   [](const ArenaRow& a, const ArenaRow& b) { return a.bytes > b.bytes; });
  std::size_t rest = row.bytes;
  for (const ArenaRow& part : parts) {
    if (part.bytes < row.bytes / 100) break;
    print_row(fmt::format("  {}", part.name), part.bytes);
    rest -= part.bytes;
  }
  if (!parts.empty()) print_row("  smaller ones", rest);
}

/// The table of --print-memory on stdout, before the drive.
void print_memory_table(const std::vector<MemoryRow>& memory) {
  std::size_t sum = 0;
  for (const MemoryRow& row : memory) {
    print_row(row.name, row.bytes);
    print_parts(row);
    sum += row.bytes;
  }
  print_row("total_bytes", sum);
  (void)std::fflush(stdout);
}

/// Time budget of a frame: live, the next one does not wait.
Duration frame_budget(const SourceFacts& facts, const RealtimeSettings& realtime) noexcept {
  if (facts.frame_interval <= Duration{}) return {};
  return realtime.frame_budget_ms > 0 ? Duration::seconds(1e-3 * realtime.frame_budget_ms)
                                      : facts.frame_interval;
}

/// Loop of the estimator's thread: takes input from the source, estimates its pose, compares it
/// with the INS, and hands everything on to the session's output.
///
/// Threads  run(): the estimator's, sealed. ask_calibration(), drained(), items(), waiting(): any.
///          Everything else: the owner's, before run() or after its thread has joined, but for
///          event_log()'s show().
/// Memory   Arenas, at construction.
class EstimationLoop {
 public:
  /// The arguments must outlive this object.
  EstimationLoop(FrameSource& source, const Configuration& configuration,
                 const SessionOptions& options)
      : source_(source),
        facts_(source.facts()),
        requests_(options.requests),
        reference_(facts_.truth),
        masks_(configuration, facts_.begin.file.rig),
        options_(estimator_options(configuration, facts_.begin.trust, facts_.adoption,
                                   masks_.views(), frame_budget(facts_, configuration.realtime))),
        estimator_arena_(Estimator::memory_needed(options_, facts_.begin.file.rig)),
        comparison_arena_(facts_.ins ? Comparison::bytes_needed(facts_.ins->options) : 0),
        runner_(make_runner(configuration.threads)),
        estimator_(std::make_unique<Estimator>(options_, facts_.begin.file.rig,
                                               facts_.begin.nominal, estimator_arena_, *runner_,
                                               watched_solver_)) {
    if (facts_.ins)
      comparison_ = std::make_unique<InsComparison>(facts_.ins->options, facts_.ins->kind,
                                                    comparison_arena_, log_);
  }

  /// Before run(). `recording`: what viewers may stop; null: nothing is recorded. `calibrations`:
  /// whose outcomes become events.
  void open(const SessionOutput& output, DriveRecorder* recording,
            CalibrationWriter* calibrations) noexcept {
    output_ = output;
    recording_ = recording;
    calibrations_ = calibrations;
    log_.open(&output_, facts_.first);
    if (comparison_) comparison_->open(&output_);
  }

  /// Logs the outcomes of saving calibrations. The estimator's thread, or after it was joined.
  void log_kept_calibrations() noexcept {
    for (CalibrationWriter::Outcome outcome; calibrations_->next(&outcome);)
      log_.log(outcome.event, outcome.failed);
  }

  /// Runs until the source is exhausted.
  void run() noexcept {
    (void)pthread_setname_np(pthread_self(), "vergence-estim");
    AllocationGuard::seal_thread();
    for (SourceItem item; next(&item);) {
      if (const auto* frame = std::get_if<SourceFrame>(&item)) handle(*frame);
      if (const auto* reading = std::get_if<InsRecord>(&item)) handle(*reading);
      if (const auto* event = std::get_if<SourceEvent>(&item)) handle(*event);
      if (comparison_) comparison_->drain();
    }
    ThreadAllocations::end();
    drained_.store(true, std::memory_order_release);
    estimator_->finish();
    log_.collect(*estimator_);
    if (comparison_) comparison_->finish();
    AllocationGuard::unseal_thread();
  }

  /// Requests a new calibration; acts at the next frame.
  void ask_calibration() noexcept { calibration_asked_.store(true, std::memory_order_relaxed); }
  /// True if the source has given its last item; the estimator may still be deciding a calibration.
  [[nodiscard]] bool drained() const noexcept { return drained_.load(std::memory_order_acquire); }
  /// Number of items handled so far.
  [[nodiscard]] std::uint64_t items() const noexcept {
    return beat_.items.load(std::memory_order_relaxed);
  }
  /// True while the loop waits for the source's next item.
  [[nodiscard]] bool waiting() const noexcept {
    return beat_.waiting.load(std::memory_order_relaxed);
  }

  [[nodiscard]] EventLog& event_log() noexcept { return log_; }
  [[nodiscard]] const EventLog& event_log() const noexcept { return log_; }
  [[nodiscard]] SessionOutput& output() noexcept { return output_; }
  [[nodiscard]] const Estimator& estimator() const noexcept { return *estimator_; }
  [[nodiscard]] const EstimatorOptions& options() const noexcept { return options_; }
  /// Null without an INS.
  [[nodiscard]] const InsComparison* comparison() const noexcept { return comparison_.get(); }
  [[nodiscard]] const ReplayableSolverRunner& solver_watch() const noexcept {
    return watched_solver_;
  }
  [[nodiscard]] const Arena& estimator_arena() const noexcept { return estimator_arena_; }
  [[nodiscard]] const Arena& comparison_arena() const noexcept { return comparison_arena_; }

 private:
  struct Beat {  // for the check that the loop does not hang
    std::atomic<std::uint64_t> items{0};
    std::atomic<bool> waiting{false};
  };
  [[nodiscard]] bool next(SourceItem* item) noexcept {
    beat_.waiting.store(true, std::memory_order_relaxed);
    const bool got = source_.next(item);
    beat_.waiting.store(false, std::memory_order_relaxed);
    beat_.items.fetch_add(got ? 1 : 0, std::memory_order_relaxed);
    return got;
  }

  void handle(const SourceEvent& event) noexcept {
    if (event.recalibrate) estimator_->request_recalibration();
    if (event.skipped) ++counts_.skipped;
    if (event.listed) log_.log(event.record, event.to_user);
  }

  void handle(const InsRecord& reading) noexcept { comparison_->add(reading); }
  void handle(const SourceFrame& frame) noexcept {
    if (calibration_asked_.exchange(false, std::memory_order_relaxed))
      request_recalibration(frame.rig.stamp, "a recalibration was requested by SIGUSR1");
    poll_requests(frame.rig.stamp);
    log_kept_calibrations();
    if (!delivering_) ThreadAllocations::begin();
    delivering_ = true;
    watched_solver_.begin_frame(frame.solver_idle);
    output_.notify(&SessionObserver::on_frame, frame.rig);
    const PoseSample sample = estimator_->process(frame.rig);
    source_.done(sample);
    const FrameReport posed = report(frame, sample);
    output_.notify(&SessionObserver::on_pose, posed);
    output_.notify(&SessionObserver::on_tracks, estimator_->tracks());
    log_.collect(*estimator_);
    log_.record_effort(sample);
    if (comparison_) return comparison_->add(posed);
    output_.notify(&SessionObserver::on_report, posed);
    log_.collect(posed);
  }

  [[nodiscard]] FrameReport report(const SourceFrame& frame, const PoseSample& sample) noexcept {
    const RigFrame& rig = frame.rig;
    if (newest_number_ && rig.number > *newest_number_ + 1)
      counts_.missing += rig.number - *newest_number_ - 1;
    newest_number_ = rig.number;
    ++counts_.read;
    ++(sample.status == PoseStatus::ok         ? counts_.ok
       : sample.status == PoseStatus::degraded ? counts_.degraded
                                               : counts_.lost);
    if (sample.status != PoseStatus::lost) {
      const Vec3& position = sample.T_world_left.t;
      if (newest_position_) counts_.path_m += (position - *newest_position_).norm();
      newest_position_ = position;
    }
    FrameReport r;
    r.pose = sample;
    r.counts = counts_;
    r.stamp_error = rig.stamp_error;
    r.spread = rig.spread;
    r.pairing = rig.pairing;
    r.cameras = rig.cameras;
    for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
      if (!rig.images[k].empty())
        r.images_present = static_cast<std::uint8_t>(r.images_present | 1U << k);
    r.estimated = monotonic_now();
    r.decode_ms = frame.decode_ms;
    if (!comparison_) r.T_reference_left = reference_.at(sample.stamp);
    return r;
  }

  void request_recalibration(Stamp stamp, const char* message) noexcept {
    estimator_->request_recalibration();
    log_.log(stamp, "recalibration_requested", message, true);
  }

  /// Handles requests of viewers.
  void poll_requests(Stamp stamp) noexcept {
    if (requests_ == nullptr) return;
    constexpr auto kOrder = std::memory_order_relaxed;
    if (requests_->recalibrate.exchange(false, kOrder) && facts_.on_request)
      request_recalibration(stamp, "a recalibration was requested on the live page");
    if (requests_->mark.exchange(false, kOrder))
      log_.log(stamp, "mark", "marked on the live page", true);
    if (requests_->stop_recording.exchange(false, kOrder) && recording_) {
      log_.log(stamp, "recording_stopped", "recording stopped on the live page; the run continues",
               true);
      recording_->stop();
    }
  }

  FrameSource& source_;
  const SourceFacts& facts_;
  SessionRequests* const requests_;  // null: no requests are possible
  const ReferenceTrack reference_;
  const CameraMasks masks_;
  const EstimatorOptions options_;
  Arena estimator_arena_, comparison_arena_;
  std::unique_ptr<PairRunner> runner_;
  BackgroundThread solver_;
  ReplayableSolverRunner watched_solver_{solver_};
  std::unique_ptr<Estimator> estimator_;
  DriveRecorder* recording_ = nullptr;
  CalibrationWriter* calibrations_ = nullptr;
  SessionOutput output_;
  EventLog log_;
  std::unique_ptr<InsComparison> comparison_;
  FrameCounts counts_{};
  std::optional<std::uint64_t> newest_number_{};
  std::optional<Vec3> newest_position_{};
  std::atomic<bool> calibration_asked_{false}, drained_{false};
  Beat beat_;
  bool delivering_ = false;  // a frame has come
};

/// The threads of a drive as they come: gives them the scheduling that `realtime:` asks for, and
/// collects their names, so that one that made no allocation is reported with its 0.
///
/// Threads  The caller's of a session.
/// Errors   What the system refuses is said on *progress; the drive goes on.
class DriveThreads {
 public:
  explicit DriveThreads(const RealtimeSettings& settings)
      : lock_(settings.lock_memory != 0), realtime_(settings.priority, system_) {
    constexpr std::size_t kThreads =
        64;  // more than a drive has, so that polling does not allocate
    threads_.reserve(kThreads);
  }

  /// Locks memory, if asked for: everything is set up, and no frame has come.
  void lock_memory(Progress* progress) {
    if (lock_) print(realtime_.lock_memory(), progress);
  }

  /// Called every 50 ms while frames come.
  void poll(Progress* progress) {
    constexpr int kAtFirst = 20, kLater = 20;  // in the first second always, then once a second
    const int count = polls_++;
    if (count >= kAtFirst && count % kLater != 0) return;
    process_threads(&threads_);
    for (const ProcessThread& thread : threads_)
      if (thread.ours()) ours_.insert(thread.name);
    print(realtime_.apply(threads_), progress);
  }

  /// ThreadAllocations' counts, beside the names that poll() has seen.
  [[nodiscard]] ThreadAllocationCounts allocations() const {
    const ThreadAllocations::Counts counts = ThreadAllocations::counts();
    std::map<std::string, std::uint64_t> ours, libraries;
    for (const std::string& name : ours_) ours[name] = 0;
    for (std::size_t i = 0; i < counts.size; ++i) {
      const std::string name = counts.rows[i].name.data();
      (ProcessThread{0, name}.ours() ? ours : libraries)[name] += counts.rows[i].count;
    }
    if (counts.others > 0) libraries["others"] = counts.others;
    ThreadAllocationCounts out;
    out.ours.assign(ours.begin(), ours.end());
    out.libraries.assign(libraries.begin(), libraries.end());
    return out;
  }

 private:
  const bool lock_;
  RealtimeSystem system_;
  RealtimeThreads realtime_;
  int polls_ = 0;
  std::vector<ProcessThread> threads_;
  std::set<std::string> ours_{};
};

/// The threads that are not 0; empty: there are none.
std::string allocations_message(const ThreadAllocationCounts& allocations) {
  std::string list;
  for (const auto* names : {&allocations.ours, &allocations.libraries})
    for (const auto& [name, count] : *names)
      if (count > 0) list += fmt::format("{}{} {}", list.empty() ? "" : ", ", name, count);
  return list.empty() ? "" : "runtime heap allocations: " + list;
}

/// Everything that is set up before the first frame and torn down after the last, in the order of
/// its members.
class SessionRunner {
 public:
  SessionRunner(FrameSource& source, const Configuration& configuration,
                const SessionOptions& options, const SignalGuard& signals)
      : source_(source),
        facts_(source.facts()),
        configuration_(configuration),
        request_(options),
        signals_(signals),
        loop_(source, configuration, options),
        threads_(configuration.realtime) {}

  [[nodiscard]] ExitCode run() {
    std::vector<std::string> faults;
    open();
    if (request_.print_memory) print_memory_table(memory());
    Progress progress = Progress::on_stderr(request_.quiet);
    const auto allocations_before = AllocationGuard::runtime_allocations();
    print_remarks(&progress);
    (void)::malloc_trim(0);  // what setting up took and gave back goes to the system
    threads_.lock_memory(&progress);
    start_source(&faults);
    std::thread estimating = start_estimating();
    service_.ready();
    watch(&progress);
    estimating.join();
    progress.finish();
    source_.finish(&progress);

    if (recording_) recording_->close(&faults);
    print_recording_errors(&progress);
    const Estimator& estimator = loop_.estimator();
    calibrations_->close(estimator.calibrated() ? &estimator.calibration() : nullptr, &faults);
    loop_.log_kept_calibrations();
    loop_.event_log().show(&progress, facts_.frames);
    const auto totals = recorder_->close();
    static_cast<CalibrationTotals&>(*totals) = calibrations_->totals();
    totals->dropped_records += calibrations_->dropped();
    const SummaryInput input =
        summary_input(*totals, AllocationGuard::runtime_allocations() - allocations_before);
    write_files(*totals, input, &faults, &progress);
    if (!request_.quiet) print_metrics(*totals, input, &progress);
    // The report reads the files: of a day's drive two are not held at once.
    totals->trajectory = std::vector<StampedPose>();  // not {}, which keeps the memory
    totals->reference = std::vector<StampedPose>();
    ReportOutcome report;
    std::string failure;  // why there is no report
    try {
      report = write_report(request_.out);
    } catch (const InputError& e) {
      failure = e.what();
    }
    ExitCode code = verdict(*totals, faults, &progress);
    if (code == ExitCode::done && !report.assessment.usable) code = ExitCode::not_usable;
    print_result(report, failure, &progress);
    return signals_.stop_code().value_or(code);
  }

 private:
  void open() {
    folder_made_ = make_session_folder(request_.out);
    try {
      open_files();
    } catch (const std::exception&) {
      leave_no_folder();
      throw;
    }
  }

  void open_files() {
    Recorder::Options to_record;
    to_record.first = facts_.first;
    to_record.when_full = facts_.when_full;
    to_record.keep_trajectory = trajectory_is_asked_for();
    to_record.ins = loop_.comparison() != nullptr;
    to_record.disk_full = facts_.disk_full;
    recorder_ = std::make_unique<Recorder>(request_.out, to_record);
    calibrations_ = std::make_unique<CalibrationWriter>(CalibrationWriter::Options{
        request_.out, facts_.begin.file, facts_.begin.state, facts_.when_full});
    observers_ = {recorder_.get(), calibrations_.get()};
    observers_.insert(observers_.end(), request_.observers.begin(), request_.observers.end());
    if (configuration_.record.any()) {
      recording_ = std::make_unique<DriveRecorder>(request_.out, configuration_, facts_,
                                                   loop_.solver_watch());
      observers_.push_back(recording_.get());
      if (configuration_.record.pulses != 0) source_.observe_pulses(recording_.get());
    }
    const SessionStart start = session_start();
    for (SessionObserver* observer : observers_) observer->on_start(start);
    loop_.open(SessionOutput(observers_), recording_.get(), calibrations_.get());
    const StartingCalibration& begin = facts_.begin;
    if (begin.trust != CalibrationTrust::none)
      loop_.output().notify(
          &SessionObserver::on_calibration,
          CalibrationRecord::begin(begin.file.rig, facts_.first, begin.cause, begin.source));
  }

  /// Returns true if the end of the session needs all poses in memory.
  [[nodiscard]] bool trajectory_is_asked_for() const {
    return loop_.comparison() != nullptr || !facts_.truth.empty() || facts_.knows_truth;
  }

  [[nodiscard]] SessionStart session_start() const {
    SessionStart start;
    start.name = request_.out.filename().string();
    start.first = facts_.first;
    start.frames = facts_.frames;
    start.tie = facts_.tie;
    const CalibrationFile& file = facts_.begin.file;
    const RigCalibration& rig = file.rig;
    start.camera_names = distinct_names({file.names.begin(), file.names.begin() + rig.cameras});
    for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
      start.image_bytes =
          std::max(start.image_bytes, static_cast<std::size_t>(rig.intrinsics[k].width) *
                                          static_cast<std::size_t>(rig.intrinsics[k].height));
    start.can_recalibrate = facts_.on_request;
    start.recording = recording_ != nullptr;
    return start;
  }

  void print_remarks(Progress* progress) {
    for (const SourceRemark& remark : facts_.remarks) {
      if (remark.print) progress->print("vergence: " + remark.message);
      if (remark.kind != nullptr)
        loop_.event_log().log(facts_.first, remark.kind, remark.message, false);
    }
  }

  void estimate() noexcept {
    loop_.run();
    const std::lock_guard lock(mutex_);
    done_ = true;
    changed_.notify_one();
  }

  void watch(Progress* progress) {
    constexpr std::chrono::milliseconds kPollInterval{50};
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, kPollInterval, [this] { return done_; })) {
      if (signals_.stop_requested()) source_.stop();
      source_.poll();
      service_.alive(loop_.items(), loop_.waiting(), source_.rounds(),
                     std::chrono::steady_clock::now());
      if (facts_.on_request && signals_.poll_calibration_request()) loop_.ask_calibration();
      lock.unlock();
      if (loop_.drained()) halt_source();
      threads_.poll(progress);
      loop_.event_log().show(progress, facts_.frames);
      print_recording_errors(progress);
      lock.lock();
    }
    lock.unlock();
    halt_source();
    loop_.event_log().show(progress, facts_.frames);
  }

  void start_source(std::vector<std::string>* faults) {
    try {
      source_.start(faults);
    } catch (const std::exception&) {
      halt_source();  // of the devices that did start some already bring what is recorded
      leave_no_folder();
      throw;
    }
  }

  /// Without it the devices' data are not consumed yet.
  [[nodiscard]] std::thread start_estimating() {
    try {
      return std::thread([this] { estimate(); });
    } catch (const std::system_error& e) {
      source_.stop();
      halt_source();
      leave_no_folder();
      throw InputError(
          fmt::format("the estimator thread cannot be started ({}): raise the limit of processes "
                      "(ulimit -u; in a service TasksMax) or of memory",
                      e.code().message()));
    }
  }

  /// Handles a session that ends before it began: a service is started again and again until its
  /// devices are there.
  void leave_no_folder() {
    std::vector<std::string> ignored;
    if (recording_) recording_->close(&ignored);
    if (calibrations_) calibrations_->close(nullptr, &ignored);
    if (recorder_) (void)recorder_->close();
    discard_session_folder(request_.out, folder_made_);
  }

  /// When the drive is over: cameras do not expose on while its last calibration is decided. That
  /// and cameras that are slow to stop may take longer than the watchdog waits.
  void halt_source() noexcept {
    service_.stopping();
    if (!halted_) source_.halt();
    halted_ = true;
  }

  void print_recording_errors(Progress* progress) {
    print(recorder_->pop_errors(), progress);
    if (recording_) print(recording_->pop_errors(), progress);
  }

  [[nodiscard]] SummaryInput summary_input(const SessionTotals& totals,
                                           std::uint64_t allocations) const {
    SummaryInput input;
    input.dropped_by_estimator = loop_.event_log().dropped();
    const Trajectory& reference = loop_.comparison() != nullptr ? totals.reference : facts_.truth;
    if (!reference.empty() && !totals.trajectory.empty())
      input.evaluation = evaluate(totals.trajectory, reference, summary_evaluation_options());
    if (const InsComparison* comparison = loop_.comparison()) {
      input.comparison = comparison->counters();
      input.earth = comparison->earth(facts_.ins->mount_source);
    }
    const Estimator& estimator = loop_.estimator();
    input.calibrated = estimator.calibrated();
    input.online = loop_.options().online;
    input.verified = input.online && estimator.verified();
    input.calibration = estimator.calibration();
    input.calibration_source = totals.accepted > 0 ? "online" : facts_.begin.source;
    if (facts_.begin.trust != CalibrationTrust::none) input.before = facts_.begin.file.rig;
    input.options = loop_.options().calibration;
    input.runtime_allocations = allocations;
    input.frame_budget = loop_.options().frame_budget;
    input.allocations = threads_.allocations();
    for (const MemoryRow& row : memory()) input.memory.emplace_back(row.name, row.bytes);
    input.configuration_hash = configuration_hash(configuration_);
    input.assumptions = facts_.assumptions;
    source_.describe(totals, estimator, &input);
    for (SessionObserver* observer : observers_)
      for (auto& counter : observer->counters()) input.devices.push_back(std::move(counter));
    return input;
  }

  void write_files(const SessionTotals& totals, const SummaryInput& input,
                   std::vector<std::string>* faults, Progress* progress) {
    // Names of files need not be UTF-8.
    const std::string text =
        summary_json(totals, input).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) +
        "\n";
    try {
      replace_durably(request_.out / "summary.json", text);
    } catch (const InputError& e) {
      faults->emplace_back(e.what());
    }
    faults->insert(faults->end(), totals.faults.begin(), totals.faults.end());
    print(recorder_->pop_errors(), progress);
    print(*faults, progress);
  }

  void print_metrics(const SessionTotals& totals, const SummaryInput& input,
                     Progress* progress) const {
    progress->print(fmt::format(
        "session {}: {} frames, {} posed ({} degraded), {} lost, {} {}; {:.2f} m; {:.1f} "
        "ms per frame, p99 {:.1f} ms",
        request_.out.string(), totals.read, totals.ok + totals.degraded, totals.degraded,
        totals.lost, input.skipped, facts_.skipped_label, totals.path_m, totals.estimate.mean(),
        totals.estimate.percentile(0.99)));
    if (input.calibrated && !input.online)
      progress->print("the calibration is not verified: calibration.online is off");
    else if (input.calibrated && !input.verified)
      progress->print(
          "the calibration was never verified; drive turns past near objects, with tracks in the "
          "image corners");
    if (const std::string message = allocations_message(input.allocations);
        request_.print_memory && !message.empty())
      progress->print(message);
    print_errors(input, progress);
  }

  /// Prints the errors against the ground truth or the reference, and against the INS.
  void print_errors(const SummaryInput& input, Progress* progress) const {
    const auto& evaluation = input.truth ? input.truth->evaluation : input.evaluation;
    if (evaluation && evaluation->status == EvaluationStatus::ok) {
      const TrajectoryEvaluation& e = *evaluation;
      const SegmentErrors &far = e.segments[0], &near = e.segments[1];
      const std::string segments =
          far.count > 0 ? fmt::format("; segments of 100 to 800 m {:.3f} %", 100 * far.translation)
          : near.count > 0
              ? fmt::format("; segments of 10 to 50 m {:.3f} %", 100 * near.translation)
              : "";
      progress->print(
          fmt::format("error against {} over {:.1f} m: ATE {:.4f} m (SE(3)), {:.4f} m with scale "
                      "{:.4f}{}",
                      input.truth ? "ground truth" : "the reference", e.path_reference,
                      e.ate_se3.rmse, e.ate_sim3.rmse, e.sim3.scale, segments));
    } else if (!facts_.ins) {
      progress->print(
          fmt::format("no reference to compare with; next: vergence evaluate {} REFERENCE",
                      (request_.out / "trajectory.tum").string()));
    }
    if (!input.earth) return;
    const EnuErrors& e = input.earth->errors;
    if (e.poses > 0)
      progress->print(fmt::format(
          "error against the INS after the alignment: {:.2f} m at the end ({:.2f} % of {:.1f} m), "
          "maximum {:.2f} m; heading {:.2f} deg RMS, {:.2f} deg at the end",
          e.horizontal_end_m, e.ins_path_m > 0 ? 100 * e.horizontal_end_m / e.ins_path_m : 0,
          e.ins_path_m, e.horizontal_max_m, e.heading_rms_deg, e.heading_end_deg));
    else
      progress->print(
          fmt::format("not compared with the INS: the alignment needs {:g} m with a fix "
                      "(comparison.alignment_distance_m)",
                      configuration_.comparison.alignment_distance_m));
  }

  [[nodiscard]] ExitCode verdict(const SessionTotals& totals,
                                 const std::vector<std::string>& faults, Progress* progress) const {
    // Also without a pose the user is informed which device was disconnected.
    const std::optional<ExitCode> of_source = source_.verdict(progress);
    if (totals.ok + totals.degraded == 0) {
      progress->print("vergence: no frame has a pose; events.jsonl and poses.csv in " +
                      request_.out.string() + " have the reasons");
      return ExitCode::not_usable;
    }
    if (of_source) return *of_source;
    if (loop_.comparison() != nullptr && loop_.comparison()->matches() == 0) {
      progress->print(
          "vergence: the INS never had a position, so no pose is compared; the poses are written");
      return ExitCode::not_usable;
    }
    return faults.empty() ? ExitCode::done : ExitCode::not_written;
  }

  /// Prints closing_lines(); with --quiet only those that must not be missed.
  void print_result(const ReportOutcome& report, const std::string& failure,
                    Progress* progress) const {
    if (request_.quiet) {
      if (!failure.empty()) progress->print("vergence: " + failure);
      if (!report.assessment.usable)
        progress->print("vergence: do not use these poses: " + report.assessment.main_reason);
      return;
    }
    constexpr std::size_t kWidth = 110;  // columns
    for (const std::string& message : closing_lines(report, failure))
      progress->print(fmt::format("{}", fmt::join(wrapped(message, kWidth), "\n  ")));
  }

  [[nodiscard]] std::vector<MemoryRow> memory() const {
    return {{"estimator_bytes", loop_.estimator_arena().capacity(), loop_.estimator_arena().rows()},
            {"comparison_bytes",
             loop_.comparison_arena().capacity() + (facts_.ins ? facts_.ins->reading_bytes : 0)},
            {"images_bytes", facts_.image_bytes},
            {"recording_bytes", recording_ ? recording_->memory() : 0},
            {"recorder_bytes", recorder_->memory() + calibrations_->memory()},
            {"rings_bytes", sizeof(Recorder) + sizeof(EventLog) + facts_.ring_bytes}};
  }

  FrameSource& source_;
  const SourceFacts& facts_;
  const Configuration& configuration_;
  const SessionOptions& request_;
  const SignalGuard& signals_;
  EstimationLoop loop_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<CalibrationWriter> calibrations_;
  std::unique_ptr<DriveRecorder> recording_;  // null: nothing is recorded
  std::vector<SessionObserver*> observers_;

  ServiceManager service_;  // of the caller's thread
  std::mutex mutex_;        // with done_, for the caller's thread that waits
  std::condition_variable changed_;
  bool done_ = false;
  bool folder_made_ = false;  // it was not there before
  bool halted_ = false;       // the caller's thread alone
  DriveThreads threads_;      // of the caller's thread
};

}  // namespace

ExitCode run_session(FrameSource& source, const Configuration& configuration,
                     const SessionOptions& options, const SignalGuard& signals) {
  const auto runner = with_plain_errors(
      [&] { return std::make_unique<SessionRunner>(source, configuration, options, signals); });
  return runner->run();
}

}  // namespace vergence::app
