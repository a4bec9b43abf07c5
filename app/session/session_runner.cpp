#include "app/session/session_runner.hpp"

#include <malloc.h>

#include <cstdio>
#include <future>
#include <set>
#include <system_error>

#include "app/datasets/reference_track.hpp"
#include "app/devices/camera_masks.hpp"
#include "app/report/report.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/service_manager.hpp"
#include "app/runtime/terminal_text.hpp"
#include "app/session/calibration_writer.hpp"
#include "app/session/drive_recorder.hpp"
#include "app/session/session_quota.hpp"
#include "core/memory/allocation_guard.hpp"
#include "core/memory/thread_allocations.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

/// Time budget of a frame: live, the next one does not wait.
Duration frame_budget(const SourceFacts& facts, const RealtimeSettings& realtime) noexcept {
  if (facts.frame_interval <= Duration{}) return {};
  return realtime.frame_budget_ms > 0 ? Duration::seconds(1e-3 * realtime.frame_budget_ms)
                                      : facts.frame_interval;
}

/// Everything that is set up before the first frame and torn down after the last, in the order of
/// its members, and the loop of the estimator's thread: it takes input from the source, estimates
/// its pose, compares it with the INS, and hands everything on to the session's observers.
class SessionRunner {
 public:
  SessionRunner(FrameSource& source, const Configuration& configuration,
                const SessionOptions& options, const SignalGuard& signals)
      : source_(source),
        facts_(source.facts()),
        configuration_(configuration),
        request_(options),
        signals_(signals),
        reference_(facts_.truth),
        masks_(configuration, facts_.begin.file.rig),
        options_(estimator_options(configuration, facts_.begin.trust, facts_.adoption,
                                   masks_.views(), frame_budget(facts_, configuration.realtime))),
        runner_(make_runner(configuration.threads)),
        estimator_(options_, facts_.begin.file.rig, facts_.begin.nominal, estimator_arena_,
                   *runner_, watched_solver_),
        progress_(Progress::on_stderr(options.quiet)),
        realtime_(configuration.realtime, realtime_system_) {
    if (facts_.ins)
      comparison_ = std::make_unique<InsComparison>(facts_.ins->options, facts_.ins->kind,
                                                    comparison_arena_, log_);
    // A run has fewer threads than this, so polling does not allocate.
    constexpr std::size_t kThreads = 64;
    threads_.reserve(kThreads);
  }
  [[nodiscard]] ExitCode run() {
    open();
    if (request_.print_memory) print_memory_table();
    const auto allocations_before = AllocationGuard::runtime_allocations();
    print_remarks();
    // Returns the memory that was used during set-up to the system.
    (void)::malloc_trim(0);
    warn(realtime_.lock_memory());
    start_source();
    std::future<void> estimating = start_estimating();
    service_.ready();
    try {
      watch(estimating);
    } catch (...) {
      // The future waits for the estimator, which waits for the end of the source.
      source_.stop();
      halt_source();
      throw;
    }
    estimating.get();
    progress_.finish();
    source_.finish(&progress_);

    if (recording_) recording_->close(&faults_);
    print_recording_errors();
    calibrations_->close(estimator_.calibrated() ? &estimator_.calibration() : nullptr, &faults_);
    log_kept_calibrations();
    log_.show(&progress_, facts_.frames);
    const auto totals = recorder_->close();
    static_cast<CalibrationTotals&>(*totals) = calibrations_->totals();
    totals->dropped_records += calibrations_->dropped();
    const SummaryInput input =
        summary_input(*totals, AllocationGuard::runtime_allocations() - allocations_before);
    write_files(*totals, input);
    if (!request_.quiet) print_metrics(*totals, input);
    // The report reads the files: of a day's drive two are not held at once.
    // Assigning {} would keep the memory.
    totals->trajectory = std::vector<StampedPose>();
    totals->reference = std::vector<StampedPose>();
    const ExitCode code = verdict(*totals);
    const bool usable = report();
    return signals_.stop_code().value_or(code == ExitCode::done && !usable ? ExitCode::not_usable
                                                                           : code);
  }

 private:
  void warn(const std::vector<std::string>& messages) {
    for (const std::string& message : messages) progress_.print("vergence: " + message);
  }
  void open() {
    // On a full disk there is room for the folder only when the quota has made some.
    if (const int quota_mb = configuration_.sessions.quota_mb; quota_mb > 0)
      removed_ = keep_session_quota(request_.out, static_cast<std::uint64_t>(quota_mb) * 1'000'000);
    folder_made_ = make_session_folder(request_.out);
    try {
      open_files();
    } catch (const std::exception&) {
      leave_no_folder();
      throw;
    }
  }
  void open_files() {
    recorder_ = std::make_unique<Recorder>(
        request_.out, Recorder::Options{.when_full = facts_.when_full,
                                        .keep_trajectory = trajectory_is_asked_for(),
                                        .ins = comparison_ != nullptr,
                                        .first = facts_.first,
                                        .disk_full = facts_.disk_full});
    calibrations_ = std::make_unique<CalibrationWriter>(CalibrationWriter::Options{
        request_.out, facts_.begin.file, facts_.begin.state, facts_.when_full});
    observers_ = {recorder_.get(), calibrations_.get()};
    observers_.insert(observers_.end(), request_.observers.begin(), request_.observers.end());
    if (configuration_.record.any()) {
      recording_ =
          std::make_unique<DriveRecorder>(request_.out, configuration_, facts_, watched_solver_);
      observers_.push_back(recording_.get());
      if (configuration_.record.pulses != 0) source_.observe_pulses(recording_.get());
    }
    const SessionStart start = session_start();
    for (SessionObserver* observer : observers_) observer->on_start(start);
    output_ = SessionOutput(observers_);
    log_.open(&output_, facts_.first);
    if (comparison_) comparison_->open(&output_);
    const StartingCalibration& begin = facts_.begin;
    if (begin.trust != CalibrationTrust::none)
      output_.post(
          &SessionObserver::on_calibration,
          CalibrationRecord::begin(begin.file.rig, facts_.first, begin.cause, begin.source));
  }
  /// Returns true if the end of the session needs all poses in memory.
  [[nodiscard]] bool trajectory_is_asked_for() const {
    return comparison_ != nullptr || !facts_.truth.empty() || facts_.knows_truth;
  }
  [[nodiscard]] SessionStart session_start() const {
    SessionStart start{.name = request_.out.filename().string(),
                       .first = facts_.first,
                       .frames = facts_.frames,
                       .tie = facts_.tie};
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
  void print_remarks() {
    warn(removed_);
    for (const std::string& message : removed_)
      log_.log({facts_.first, "session_removed", message}, false);
    for (const SourceRemark& remark : facts_.remarks) {
      if (remark.print) progress_.print("vergence: " + remark.message);
      if (remark.kind != nullptr) log_.log({facts_.first, remark.kind, remark.message}, false);
    }
  }
  /// Threads are examined at every poll in the first second, then once per second.
  void poll_threads() {
    constexpr int kAtFirst = 20, kLater = 20;
    const int count = polls_++;
    if (count >= kAtFirst && count % kLater != 0) return;
    process_threads(&threads_);
    for (const ProcessThread& thread : threads_)
      if (thread.own()) own_threads_.insert(thread.name);
    warn(realtime_.apply(threads_));
  }
  void watch(const std::future<void>& estimating) {
    constexpr std::chrono::milliseconds kPollInterval{50};
    while (estimating.wait_for(kPollInterval) == std::future_status::timeout) {
      if (signals_.stop_requested()) source_.stop();
      source_.poll();
      service_.alive(items_, waiting_, source_.rounds(), std::chrono::steady_clock::now());
      if (facts_.on_request && signals_.poll_calibration_request()) calibration_asked_ = true;
      if (drained_) halt_source();
      poll_threads();
      log_.show(&progress_, facts_.frames);
      print_recording_errors();
    }
    halt_source();
    log_.show(&progress_, facts_.frames);
  }
  void start_source() {
    try {
      source_.start(&faults_);
    } catch (const std::exception&) {
      // Devices that did start may already deliver data to the recording.
      halt_source();
      leave_no_folder();
      throw;
    }
  }
  /// Without it the devices' data are not consumed yet.
  [[nodiscard]] std::future<void> start_estimating() {
    try {
      return std::async(std::launch::async, [this] { estimate(); });
    } catch (const std::system_error& e) {
      source_.stop();
      halt_source();
      leave_no_folder();
      throw InputError(
          "the estimator thread cannot be started ({}); raise the limit of processes (ulimit -u; "
          "in a service TasksMax) or of memory",
          e.code().message());
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
  void print_recording_errors() {
    warn(recorder_->pop_errors());
    if (recording_) warn(recording_->pop_errors());
  }
  [[nodiscard]] SummaryInput summary_input(const SessionTotals& totals,
                                           std::uint64_t runtime_allocations) const {
    SummaryInput input{.dropped_by_estimator = log_.dropped()};
    const Trajectory& reference = comparison_ != nullptr ? totals.reference : facts_.truth;
    if (!reference.empty() && !totals.trajectory.empty())
      input.evaluation = evaluate(totals.trajectory, reference, summary_evaluation_options());
    if (comparison_) {
      input.comparison = comparison_->counters();
      input.enu = comparison_->enu_json(facts_.ins->mount_source);
    }
    input.calibrated = estimator_.calibrated();
    input.online = options_.online;
    input.verified = input.online && estimator_.verified();
    input.calibration = estimator_.calibration();
    input.calibration_source = totals.accepted > 0 ? "online" : facts_.begin.source;
    if (facts_.begin.trust != CalibrationTrust::none) input.before = facts_.begin.file.rig;
    input.options = options_.calibration;
    input.runtime_allocations = runtime_allocations;
    input.frame_budget = options_.frame_budget;
    input.allocations = allocations();
    input.memory = memory();
    input.configuration_hash = configuration_hash(configuration_);
    input.assumptions = facts_.assumptions;
    source_.describe(totals, estimator_, &input);
    for (SessionObserver* observer : observers_)
      for (auto& counter : observer->counters()) input.devices.push_back(std::move(counter));
    return input;
  }
  void write_files(const SessionTotals& totals, const SummaryInput& input) {
    try {
      // Names of files need not be UTF-8.
      replace_durably(request_.out / "summary.json",
                      summary_json(totals, input)
                              .dump(2, ' ', false, nlohmann::json::error_handler_t::replace) +
                          "\n");
    } catch (const InputError& e) {
      faults_.emplace_back(e.what());
    }
    faults_.insert(faults_.end(), totals.faults.begin(), totals.faults.end());
    print_recording_errors();
    warn(faults_);
  }
  void print_metrics(const SessionTotals& totals, const SummaryInput& input) {
    progress_.print(
        "session {}: {} frames, {} posed ({} degraded), {} lost, {} {}; {:.2f} m; estimator {:.1f} "
        "ms per frame, p99 {:.1f} ms",
        request_.out.string(), totals.read, totals.ok + totals.degraded, totals.degraded,
        totals.lost, input.skipped, facts_.skipped_label, totals.path_m, totals.estimate.mean(),
        totals.estimate.percentile(0.99));
    if (input.calibrated && !input.online)
      progress_.print("the calibration is not verified: calibration.online is off");
    else if (input.calibrated && !input.verified)
      progress_.print(
          "the calibration was never verified; drive turns past near objects, with tracks in the "
          "image corners");
    if (request_.print_memory) print_allocations(input.allocations);
    source_.print_metrics(input, &progress_);
  }
  void print_allocations(const ThreadAllocationCounts& allocations) {
    std::vector<std::string> list;
    for (const auto* threads : {&allocations.own, &allocations.libraries})
      for (const auto& [name, count] : *threads)
        if (count > 0) list.push_back(fmt::format("{} {}", name, count));
    if (!list.empty()) progress_.print("runtime heap allocations: {}", fmt::join(list, ", "));
  }
  [[nodiscard]] ExitCode verdict(const SessionTotals& totals) {
    // Also without a pose the user is informed which device was disconnected.
    const std::optional<ExitCode> of_source = source_.verdict(&progress_);
    if (totals.ok + totals.degraded == 0) {
      progress_.print("vergence: no frame has a pose; events.jsonl and poses.csv in " +
                      request_.out.string() + " have the reasons");
      return ExitCode::not_usable;
    }
    if (of_source) return *of_source;
    if (comparison_ != nullptr && comparison_->matches() == 0) {
      progress_.print(
          "vergence: the INS never had a position, so no pose is compared; the poses are written; "
          "check its antenna");
      return ExitCode::not_usable;
    }
    return faults_.empty() ? ExitCode::done : ExitCode::not_written;
  }
  /// Writes report.html and prints the closing lines; with `quiet` only those that must not be
  /// missed. Returns false if no pose can be relied on.
  [[nodiscard]] bool report() {
    ReportOutcome outcome;
    try {
      outcome = write_report(request_.out);
    } catch (const InputError& e) {
      progress_.print(std::string("vergence: ") + e.what());
      return true;
    }
    if (request_.quiet) {
      if (!outcome.assessment.usable)
        progress_.print("vergence: do not use these poses: " + outcome.assessment.main_reason);
      return outcome.assessment.usable;
    }
    // Number of columns.
    constexpr std::size_t kWidth = 110;
    for (const std::string& message : closing_lines(outcome))
      progress_.print("{}", fmt::join(wrapped(message, kWidth), "\n  "));
    return outcome.assessment.usable;
  }
  /// Bytes by component.
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory() const {
    return {{"estimator_bytes", estimator_arena_.used()},
            {"comparison_bytes",
             comparison_arena_.used() + (facts_.ins ? facts_.ins->reading_bytes : 0)},
            {"images_bytes", facts_.image_bytes},
            {"recording_bytes", recording_ ? recording_->memory() : 0},
            {"recorder_bytes", recorder_->memory() + calibrations_->memory()},
            {"rings_bytes", sizeof(Recorder) + sizeof(EventLog) + facts_.ring_bytes}};
  }
  /// ThreadAllocations' counts, and the names of threads that made no allocation.
  [[nodiscard]] ThreadAllocationCounts allocations() const {
    const ThreadAllocations::Counts counts = ThreadAllocations::counts();
    ThreadAllocationCounts out;
    for (const std::string& name : own_threads_) out.own[name] = 0;
    for (std::size_t i = 0; i < counts.size; ++i) {
      const std::string name = counts.rows[i].name.data();
      (ProcessThread{0, name}.own() ? out.own : out.libraries)[name] += counts.rows[i].count;
    }
    if (counts.others > 0) out.libraries["others"] = counts.others;
    return out;
  }
  /// Prints the components on stdout, and the parts of the estimator's arena, the largest first.
  void print_memory_table() const {
    const auto print = [](const std::string& name, std::size_t bytes) {
      fmt::print("{:<44}{:>14}\n", name, bytes);
    };
    std::size_t sum = 0;
    for (const auto& [name, bytes] : memory()) {
      print(name, bytes);
      sum += bytes;
    }
    print("total_bytes", sum);
    const auto rows = estimator_arena_.rows();
    std::vector<ArenaRow> parts(rows.begin(), rows.end());
    std::ranges::stable_sort(parts, std::greater<>(), &ArenaRow::bytes);
    for (const ArenaRow& part : parts) print(fmt::format("  {}", part.name), part.bytes);
    (void)std::fflush(stdout);
  }
  void log_kept_calibrations() noexcept {
    for (EventRecord event; calibrations_->next(&event);)
      log_.log(event, event.kind == std::string_view("calibration_save_failed"));
  }

  [[nodiscard]] bool next(SourceItem* item) noexcept {
    waiting_ = true;
    const bool got = source_.next(item);
    waiting_ = false;
    items_ += got ? 1 : 0;
    return got;
  }

  void estimate() noexcept {
    (void)pthread_setname_np(pthread_self(), "vergence-estim");
    AllocationGuard::seal_thread();
    for (SourceItem item; next(&item);) {
      std::visit([this](const auto& value) { handle(value); }, item);
      if (comparison_) comparison_->drain();
    }
    ThreadAllocations::end();
    drained_ = true;
    estimator_.finish();
    log_.collect(estimator_);
    if (comparison_) comparison_->finish();
    AllocationGuard::unseal_thread();
  }

  void handle(const InsRecord& reading) noexcept { comparison_->add(reading); }
  void handle(const SourceEvent& event) noexcept {
    if (event.recalibrate) estimator_.request_recalibration();
    if (event.skipped) ++counts_.skipped;
    if (event.listed) log_.log(event.record, event.to_user);
  }

  void request_recalibration(Stamp stamp, const char* message) noexcept {
    estimator_.request_recalibration();
    log_.log({stamp, "recalibration_requested", message});
  }

  /// Handles requests of viewers.
  void poll_requests(Stamp stamp) noexcept {
    if (request_.requests == nullptr) return;
    SessionRequests& requests = *request_.requests;
    if (requests.recalibrate.exchange(false) && facts_.on_request)
      request_recalibration(stamp, "a recalibration was requested on the live page");
    if (requests.mark.exchange(false)) log_.log({stamp, "mark", "marked on the live page"});
    if (requests.stop_recording.exchange(false) && recording_) {
      log_.log(
          {stamp, "recording_stopped", "recording stopped on the live page; the run continues"});
      recording_->stop();
    }
  }

  void handle(const SourceFrame& frame) noexcept {
    if (calibration_asked_.exchange(false))
      request_recalibration(frame.rig.stamp, "a recalibration was requested by SIGUSR1");
    poll_requests(frame.rig.stamp);
    log_kept_calibrations();
    if (!delivering_) ThreadAllocations::begin();
    delivering_ = true;
    watched_solver_.begin_frame(frame.solver_idle);
    output_.post(&SessionObserver::on_frame, frame.rig);
    const PoseSample sample = estimator_.process(frame.rig);
    source_.done(sample);
    const FrameReport posed = frame_report(frame, sample);
    output_.post(&SessionObserver::on_pose, posed);
    output_.post(&SessionObserver::on_tracks, estimator_.tracks());
    log_.collect(estimator_);
    log_.record_effort(sample);
    if (comparison_) return comparison_->add(posed);
    output_.post(&SessionObserver::on_report, posed);
    log_.collect(posed);
  }

  [[nodiscard]] FrameReport frame_report(const SourceFrame& frame,
                                         const PoseSample& sample) noexcept {
    const RigFrame& rig = frame.rig;
    if (newest_number_ && rig.number > *newest_number_ + 1)
      counts_.missing += rig.number - *newest_number_ - 1;
    newest_number_ = rig.number;
    counts_.add(sample);
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

  FrameSource& source_;
  const SourceFacts& facts_;
  const Configuration& configuration_;
  const SessionOptions& request_;
  const SignalGuard& signals_;

  const ReferenceTrack reference_;
  const CameraMasks masks_;
  const EstimatorOptions options_;
  Arena estimator_arena_, comparison_arena_;
  const std::unique_ptr<PairRunner> runner_;
  BackgroundThread solver_;
  ReplayableSolverRunner watched_solver_{solver_};
  Estimator estimator_;
  SessionOutput output_;
  EventLog log_;
  // Null without an INS.
  std::unique_ptr<InsComparison> comparison_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<CalibrationWriter> calibrations_;
  // Null if nothing is recorded.
  std::unique_ptr<DriveRecorder> recording_;
  std::vector<SessionObserver*> observers_;

  // Used by the estimator's thread only.
  FrameCounts counts_{};
  std::optional<std::uint64_t> newest_number_{};
  // True after the first frame.
  bool delivering_ = false;

  // Items handled so far, and whether the loop waits for the next one, for the hang detection.
  std::atomic<std::uint64_t> items_{0};
  std::atomic<bool> waiting_{false};
  // True once the source has given its last item; the estimator may still decide a calibration.
  std::atomic<bool> drained_{false};
  // Requests a new calibration before the next frame.
  std::atomic<bool> calibration_asked_{false};

  // Used by the caller's thread only.
  Progress progress_;
  // A message for each incomplete file.
  std::vector<std::string> faults_;
  ServiceManager service_;
  // True if this session created its directory.
  bool folder_made_ = false;
  // One message per session that was deleted to respect the quota.
  std::vector<std::string> removed_;
  bool halted_ = false;
  RealtimeSystem realtime_system_;
  RealtimeThreads realtime_;
  int polls_ = 0;
  std::vector<ProcessThread> threads_;
  std::set<std::string> own_threads_{};
};

}  // namespace

ExitCode run_session(FrameSource& source, const Configuration& configuration,
                     const SessionOptions& options, const SignalGuard& signals) {
  return std::make_unique<SessionRunner>(source, configuration, options, signals)->run();
}

}  // namespace vergence::app
