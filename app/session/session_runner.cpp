#include "app/session/session_runner.hpp"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "app/report/report.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/service_manager.hpp"
#include "app/runtime/terminal_text.hpp"
#include "app/session/calibration_writer.hpp"
#include "app/session/drive_recorder.hpp"
#include "app/session/drive_threads.hpp"
#include "app/session/estimation_loop.hpp"
#include "app/session/session_quota.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

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
    if (request_.print_memory) print_memory_table();
    Progress progress = Progress::on_stderr(request_.quiet);
    const auto allocations_before = AllocationGuard::runtime_allocations();
    print_remarks(&progress);
    // Returns the memory that was used during set-up to the system.
    (void)::malloc_trim(0);
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
    // Assigning {} would keep the memory.
    totals->trajectory = std::vector<StampedPose>();
    totals->reference = std::vector<StampedPose>();
    const ExitCode code = verdict(*totals, faults, &progress);
    const bool usable = report(&progress);
    return signals_.stop_code().value_or(code == ExitCode::done && !usable ? ExitCode::not_usable
                                                                           : code);
  }

 private:
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
      loop_.output().post(
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
    for (const std::string& message : removed_) {
      progress->print("vergence: " + message);
      loop_.event_log().log(facts_.first, "session_removed", message, false);
    }
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
      // Devices that did start may already deliver data to the recording.
      halt_source();
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
          fmt::format("the estimator thread cannot be started ({}); raise the limit of processes "
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
    for (const std::string& message : recorder_->pop_errors())
      progress->print("vergence: " + message);
    if (!recording_) return;
    for (const std::string& message : recording_->pop_errors())
      progress->print("vergence: " + message);
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
    input.memory = memory();
    input.configuration_hash = configuration_hash(configuration_);
    input.assumptions = facts_.assumptions;
    source_.describe(totals, estimator, &input);
    for (SessionObserver* observer : observers_)
      for (auto& counter : observer->counters()) input.devices.push_back(std::move(counter));
    return input;
  }
  void write_files(const SessionTotals& totals, const SummaryInput& input,
                   std::vector<std::string>* faults, Progress* progress) {
    try {
      // Names of files need not be UTF-8.
      replace_durably(request_.out / "summary.json",
                      summary_json(totals, input)
                              .dump(2, ' ', false, nlohmann::json::error_handler_t::replace) +
                          "\n");
    } catch (const InputError& e) {
      faults->emplace_back(e.what());
    }
    faults->insert(faults->end(), totals.faults.begin(), totals.faults.end());
    print_recording_errors(progress);
    for (const std::string& message : *faults) progress->print("vergence: " + message);
  }
  void print_metrics(const SessionTotals& totals, const SummaryInput& input,
                     Progress* progress) const {
    progress->print(
        fmt::format("session {}: {} frames, {} posed ({} degraded), {} lost, {} {}; {:.2f} m; "
                    "estimator {:.1f} ms per frame, p99 {:.1f} ms",
                    request_.out.string(), totals.read, totals.ok + totals.degraded,
                    totals.degraded, totals.lost, input.skipped, facts_.skipped_label,
                    totals.path_m, totals.estimate.mean(), totals.estimate.percentile(0.99)));
    if (input.calibrated && !input.online)
      progress->print("the calibration is not verified: calibration.online is off");
    else if (input.calibrated && !input.verified)
      progress->print(
          "the calibration was never verified; drive turns past near objects, with tracks in the "
          "image corners");
    if (const std::string message = allocations_message(input.allocations);
        request_.print_memory && !message.empty())
      progress->print(message);
    source_.print_metrics(input, progress);
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
          "vergence: the INS never had a position, so no pose is compared; the poses are written; "
          "check its antenna");
      return ExitCode::not_usable;
    }
    return faults.empty() ? ExitCode::done : ExitCode::not_written;
  }
  /// Writes report.html and prints the closing lines; with `quiet` only those that must not be
  /// missed. Returns false if no pose can be relied on.
  [[nodiscard]] bool report(Progress* progress) const {
    ReportOutcome outcome;
    try {
      outcome = write_report(request_.out);
    } catch (const InputError& e) {
      progress->print(std::string("vergence: ") + e.what());
      return true;
    }
    if (request_.quiet) {
      if (!outcome.assessment.usable)
        progress->print("vergence: do not use these poses: " + outcome.assessment.main_reason);
      return outcome.assessment.usable;
    }
    // Number of columns.
    constexpr std::size_t kWidth = 110;
    for (const std::string& message : closing_lines(outcome))
      progress->print(fmt::format("{}", fmt::join(wrapped(message, kWidth), "\n  ")));
    return outcome.assessment.usable;
  }
  /// Bytes by component.
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory() const {
    return {{"estimator_bytes", loop_.estimator_arena().used()},
            {"comparison_bytes",
             loop_.comparison_arena().used() + (facts_.ins ? facts_.ins->reading_bytes : 0)},
            {"images_bytes", facts_.image_bytes},
            {"recording_bytes", recording_ ? recording_->memory() : 0},
            {"recorder_bytes", recorder_->memory() + calibrations_->memory()},
            {"rings_bytes", sizeof(Recorder) + sizeof(EventLog) + facts_.ring_bytes}};
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
    const auto rows = loop_.estimator_arena().rows();
    std::vector<ArenaRow> parts(rows.begin(), rows.end());
    std::ranges::stable_sort(parts, std::greater<>(), &ArenaRow::bytes);
    for (const ArenaRow& part : parts) print(fmt::format("  {}", part.name), part.bytes);
    (void)std::fflush(stdout);
  }

  FrameSource& source_;
  const SourceFacts& facts_;
  const Configuration& configuration_;
  const SessionOptions& request_;
  const SignalGuard& signals_;
  EstimationLoop loop_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<CalibrationWriter> calibrations_;
  // Null if nothing is recorded.
  std::unique_ptr<DriveRecorder> recording_;
  std::vector<SessionObserver*> observers_;

  // Used by the caller's thread only.
  ServiceManager service_;
  // Guards `done_` for the caller's thread, which waits on `changed_`.
  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  // True if this session created its directory.
  bool folder_made_ = false;
  // One message per session that was deleted to respect the quota.
  std::vector<std::string> removed_;
  // Used by the caller's thread only.
  bool halted_ = false;
  // Used by the caller's thread only.
  DriveThreads threads_;
};

}  // namespace

ExitCode run_session(FrameSource& source, const Configuration& configuration,
                     const SessionOptions& options, const SignalGuard& signals) {
  const auto runner = with_plain_errors(
      [&] { return std::make_unique<SessionRunner>(source, configuration, options, signals); });
  return runner->run();
}

}  // namespace vergence::app
