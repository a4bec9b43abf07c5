#include "app/commands/run_session.hpp"

#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "app/commands/camera_masks.hpp"
#include "app/commands/drive_devices.hpp"
#include "app/commands/drive_sync.hpp"
#include "app/commands/event_log.hpp"
#include "app/commands/exposure_settings.hpp"
#include "app/commands/ins_comparison.hpp"
#include "app/commands/session_files.hpp"
#include "app/commands/timing_monitor.hpp"
#include "app/datasets/decimal.hpp"
#include "app/recorder/line_file.hpp"
#include "app/recorder/recorder.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/runtime/exposure_control.hpp"
#include "app/runtime/live_source.hpp"
#include "app/runtime/progress.hpp"
#include "app/runtime/signals.hpp"
#include "core/estimator/estimator.hpp"
#include "core/memory/allocation_guard.hpp"

namespace vergence::app {
namespace {

constexpr Stamp kVirtualEpoch{
    1'577'836'800'000'000'000};  // 2020-01-01 00:00 UTC: a drive in virtual time has the same
                                 // stamps on every run

std::int64_t clock_ns(clockid_t clock) {
  timespec t{};
  (void)::clock_gettime(clock, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

std::vector<std::string> serials_of(const std::vector<CameraDevice*>& cameras) {
  std::vector<std::string> serials;
  for (const CameraDevice* camera : cameras) serials.push_back(camera->info().serial);
  return serials;
}

/// Everything that is set up before the first frame and torn down after the last, in the order of
/// its members.
class Drive {
 public:
  explicit Drive(const RunRequest& request);
  [[nodiscard]] ExitCode run();

 private:
  void begin();
  void estimate() noexcept;
  void handle_images(const LiveItem& item) noexcept;
  void tell(Stamp stamp, const TimingMonitor::Sentence& sentence) noexcept;
  void note_faults(Stamp stamp) noexcept;
  void watch(Progress* progress);
  void write_truth(std::vector<std::string>* faults) const;
  [[nodiscard]] SummaryInput summary_input(const SessionTotals& totals,
                                           std::uint64_t allocations) const;
  [[nodiscard]] TruthFigures truth_figures(const SessionTotals& totals) const;
  void tell(const SessionTotals& totals, const SummaryInput& input, Progress* progress) const;
  [[nodiscard]] ExitCode verdict(const SessionTotals& totals,
                                 const std::vector<std::string>& faults, Progress* progress) const;
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory() const;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> device_counters() const;

  const SignalGuard signals_;  // before the world is built, which takes seconds: an impatient
                               // user's signal is heard
  const RunRequest& request_;
  const Configuration& configuration_;
  DriveDevices devices_;
  const StartingCalibration begin_;
  const CameraMasks masks_;
  const EstimatorOptions options_;
  ComparisonOptions comparison_options_;
  Arena arena_;
  std::unique_ptr<PairRunner> runner_;
  BackgroundThread solver_;
  std::unique_ptr<Estimator> estimator_;
  EventLog journal_;  // of the estimator's thread, as all after recorder_
  std::unique_ptr<InsComparison> comparison_;
  std::unique_ptr<ExposureControl> exposure_;  // null: exposures are fixed
  std::unique_ptr<LiveSource> source_;
  std::unique_ptr<Recorder> recorder_;
  Stamp start_{};  // of the drive
  std::vector<StampedPose> truth_;

  // Of the estimator's thread; read by others after it has joined.
  TimingMonitor time_;
  std::vector<bool> fault_told_;

  std::atomic<bool> calibration_asked_{false};  // by the caller's thread, for the estimator's
  std::mutex mutex_;                            // with done_, for the caller's thread that waits
  std::condition_variable changed_;
  bool done_ = false;
};

Drive::Drive(const RunRequest& request)
    : request_(request),
      configuration_(request.configuration),
      devices_(request.configuration, request.faults, request.fast, request.duration_s),
      begin_(starting_calibration(request.configuration, request.calibration,
                                  serials_of(devices_.cameras()))),
      masks_(request.configuration, begin_.file.rig),
      options_(estimator_options(request.configuration, begin_.trust,
                                 request.fast ? Adoption::after_fixed_frames : Adoption::when_ready,
                                 masks_.views())),
      comparison_options_(comparison_options(request.configuration)),
      arena_(arena_size(Estimator::memory_needed(options_, begin_.file.rig)) +
             arena_size(Comparison::bytes_needed(comparison_options_))),
      runner_(make_runner(request.configuration.threads)),
      estimator_(std::make_unique<Estimator>(options_, begin_.file.rig, begin_.nominal, arena_,
                                             *runner_, solver_)),
      comparison_(std::make_unique<InsComparison>(
          comparison_options_,
          devices_.ins() != nullptr ? InsComparison::Source::device : InsComparison::Source::none,
          arena_, journal_)),
      time_(devices_.sync().mode, request.fast),
      fault_told_(devices_.faults().size(), false) {
  LiveSource::Options o;
  o.sync = devices_.sync();
  o.wait_when_full = request.fast;
  o.board_keeps_own_time = devices_.board_keeps_own_time();
  o.sync_out_divider = devices_.sync_out_divider();
  o.stamp_grid = stamp_grid(configuration_);
  o.tie_stamp = request.fast ? kVirtualEpoch : Stamp(clock_ns(CLOCK_REALTIME));
  o.tie_host = request.fast ? devices_.start() : HostStamp(clock_ns(CLOCK_MONOTONIC));
  if (exposes_by_itself(configuration_)) {
    const CameraSettings& c = configuration_.cameras[0];
    exposure_ = std::make_unique<ExposureControl>(
        devices_.cameras(), c.width, c.height, masks_.views()[0], exposure_options(configuration_),
        starting_exposure(configuration_, 0), request.fast);
  }
  source_ = std::make_unique<LiveSource>(exposure_ ? exposure_->cameras() : devices_.cameras(),
                                         devices_.ins(), devices_.trigger(), o);
  start_ = o.tie_stamp + (devices_.start() - o.tie_host);
}

// ---- the estimator's thread

void Drive::estimate() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-estim");
  AllocationGuard::seal_thread();
  for (LiveItem item; source_->next(&item);) {
    switch (item.kind) {
      case LiveItem::Kind::images:
        handle_images(item);
        break;
      case LiveItem::Kind::reading:
        comparison_->add({item.sample, item.quality});
        tell(item.stamp, time_.of_reading(item));
        break;
      default:
        tell(item.stamp, time_.of_device(item));
        break;
    }
    comparison_->drain();
  }
  estimator_->finish();
  journal_.note(*estimator_);
  comparison_->finish();
  AllocationGuard::unseal_thread();
  const std::lock_guard lock(mutex_);
  done_ = true;
  changed_.notify_one();
}

void Drive::tell(Stamp stamp, const TimingMonitor::Sentence& sentence) noexcept {
  if (sentence.kind != nullptr)
    journal_.tell(stamp, sentence.kind, sentence.text.data(), sentence.aloud);
}

void Drive::handle_images(const LiveItem& item) noexcept {
  RigFrame frame;
  frame.number = item.set.number;
  frame.stamp = item.stamp;
  frame.stamp_error = item.set.error;
  frame.spread = item.set.spread;
  frame.cameras = begin_.file.rig.cameras;
  tell(item.stamp, time_.of_set(item.set));
  const bool contradicted = time_.contradicted(item.set);
  for (int k = 0, used = 0; k < frame.cameras && !(contradicted && used > 0); ++k) {
    frame.images[static_cast<std::size_t>(k)] = source_->image(item.set, k);
    used += item.set.present[static_cast<std::size_t>(k)] ? 1 : 0;
  }
  note_faults(item.stamp);
  if (calibration_asked_.exchange(false, std::memory_order_relaxed)) {
    estimator_->request_recalibration();
    journal_.tell(item.stamp, "recalibration_requested",
                  "a new calibration was asked for by SIGUSR1", true);
  }
  PoseSample sample = estimator_->process(frame);
  if (contradicted && sample.status != PoseStatus::lost) {
    sample.status = PoseStatus::degraded;
    sample.reason = Reason::unproven_pairing;
  }
  time_.note_pose(item.set, sample.estimate_ms,
                  request_.fast ? HostStamp{} : HostStamp(clock_ns(CLOCK_MONOTONIC)));
  source_->release(item.set);
  journal_.note(*estimator_);
  journal_.note(sample);
  comparison_->add(sample, 0.0F);
}

void Drive::note_faults(Stamp stamp) noexcept {
  const auto faults = devices_.faults();
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (fault_told_[i] || stamp < start_ + faults[i].at) continue;
    fault_told_[i] = true;
    std::array<char, 96> text{};
    const std::string_view kind = mock::to_string(faults[i].kind);
    if (faults[i].kind == mock::FaultKind::recalibrate) estimator_->request_recalibration();
    (void)std::snprintf(text.data(), text.size(), "%.*s, as scheduled",
                        static_cast<int>(kind.size()), kind.data());
    journal_.tell(start_ + faults[i].at, "fault", text.data(), false);
  }
}

// ---- the caller's thread

void Drive::watch(Progress* progress) {
  constexpr std::chrono::milliseconds kLook{50};
  const auto begun = std::chrono::steady_clock::now();
  const auto over = [&] {  // real cameras do not end by themselves
    return devices_.mock() == nullptr && request_.duration_s &&
           std::chrono::steady_clock::now() - begun >
               std::chrono::duration<double>(*request_.duration_s);
  };
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLook, [this] { return done_; })) {
    if (signals_.stop_requested() || over()) source_->stop();
    if (signals_.take_calibration_request())
      calibration_asked_.store(true, std::memory_order_relaxed);
    lock.unlock();
    journal_.show(progress, devices_.frames());
    lock.lock();
  }
  lock.unlock();
  journal_.show(progress, devices_.frames());
}

void Drive::write_truth(std::vector<std::string>* faults) const {
  try {
    LineFile file(request_.out / "truth.tum");
    for (const StampedPose& pose : truth_) {
      const PoseNumbers n = PoseNumbers::of(pose.T_world_body);
      (void)file.append(fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                                    format_seconds(pose.stamp.ns()), n.t[0], n.t[1], n.t[2], n.q[0],
                                    n.q[1], n.q[2], n.q[3]));
    }
    if (!file.close())
      faults->push_back(file.path().string() + ": is not complete; make room on that disk");
  } catch (const InputError& e) {
    faults->emplace_back(e.what());
  }
}

std::vector<std::pair<std::string, std::size_t>> Drive::memory() const {
  return {{"estimator_bytes", arena_.capacity()},
          {"images_bytes", devices_.image_bytes()},
          {"rings_bytes", sizeof(Recorder) + sizeof(LiveSource)}};
}

std::vector<std::pair<std::string, std::uint64_t>> Drive::device_counters() const {
  const LiveCounters& c = source_->counters();
  std::vector<std::pair<std::string, std::uint64_t>> out{
      {"sets_complete", c.sync.complete},
      {"sets_incomplete", c.sync.incomplete},
      {"pulses_missed", c.sync.missed},
      {"sets_overtaken", c.dropped_sets},
      {"readings_dropped", c.dropped_readings},
      {"frames_torn", c.torn},
      {"sets_unproven", c.sync.unproven},
      {"clock_resets", c.clock_resets},
      {"worst_stamp_error_ns", static_cast<std::uint64_t>(c.worst_stamp_error_ns)}};
  if (exposure_) {
    const ExposureCounters e = exposure_->counters();
    out.insert(out.end(),
               {{"exposure_changes", e.changes},
                {"exposure_refused", e.refused},
                {"exposure_unequal", e.unequal},
                {"exposure_again", e.again},
                {"exposure_last_us", static_cast<std::uint64_t>(e.newest.exposure.ns() / 1000)},
                {"gain_last_millidb", static_cast<std::uint64_t>(1000 * e.newest.gain_db)}});
  }
  for (int k = 0; k < begin_.file.rig.cameras; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const CameraStatistics s = devices_.cameras()[i]->statistics();
    const std::string name = fmt::format("camera{}_", k);
    out.insert(out.end(), {{name + "delivered", s.delivered},
                           {name + "lost", s.lost},
                           {name + "underruns", s.underruns},
                           {name + "starts", s.starts},
                           {name + "unpaired", c.sync.lost[i]},
                           {name + "absent", c.sync.absent[i]},
                           {name + "duplicate", c.sync.duplicate[i]},
                           {name + "late", c.sync.late[i]}});
  }
  return out;
}

TruthFigures Drive::truth_figures(const SessionTotals& totals) const {
  TruthFigures figures;
  if (totals.trajectory.empty() || devices_.mock() == nullptr) return figures;
  figures.evaluation = evaluate(totals.trajectory, truth_, summary_evaluation_options());
  if (estimator_->calibrated())
    figures.calibration_error = calibration_errors(
        estimator_->calibration(),
        devices_.mock()->truth().calibration(totals.trajectory.back().stamp - start_));
  return figures;
}

SummaryInput Drive::summary_input(const SessionTotals& totals, std::uint64_t allocations) const {
  SummaryInput input;
  const LiveCounters& c = source_->counters();
  // Pulses whose images nobody estimated from: of some no set came, because nothing proved yet
  // which images were theirs.
  const auto acquiring = std::min_element(c.sync.acquiring.begin(),
                                          c.sync.acquiring.begin() + begin_.file.rig.cameras);
  input.skipped = c.dropped_sets + c.sync.missed + *acquiring;
  input.dropped_by_estimator = journal_.dropped();
  if (!totals.reference.empty() && !totals.trajectory.empty())
    input.evaluation = evaluate(totals.trajectory, totals.reference, summary_evaluation_options());
  describe_calibration(*estimator_, begin_, totals, options_, journal_.matches(), &input);
  input.allocations_after_seal = allocations;
  input.memory = memory();
  input.configuration_hash = configuration_hash(configuration_);
  input.devices = device_counters();
  if (devices_.ins() != nullptr) {
    input.comparison = comparison_->counters();
    input.earth = comparison_->earth("the configuration");
  }
  input.time = time_.figures(c, devices_);
  if (devices_.mock() != nullptr) input.truth = truth_figures(totals);
  return input;
}

void Drive::tell(const SessionTotals& totals, const SummaryInput& input, Progress* progress) const {
  progress->say(fmt::format(
      "session {}: {} frames, {} posed ({} degraded), {} lost, {} dropped; {:.2f} m; {:.1f} ms a "
      "frame, {:.1f} at p99",
      request_.out.string(), totals.read, totals.ok + totals.degraded, totals.degraded, totals.lost,
      input.skipped, totals.path_m, totals.estimate.mean(), totals.estimate.percentile(0.99)));
  if (const std::string sentence = verification_sentence(input); !sentence.empty())
    progress->say(sentence);
  if (!input.truth || !input.truth->evaluation ||
      input.truth->evaluation->status != EvaluationStatus::ok)
    return;
  const TrajectoryEvaluation& e = *input.truth->evaluation;
  const SegmentErrors &far = e.segments[0], &near = e.segments[1];
  const std::string segments =
      far.count > 0    ? fmt::format("; segments of 100 to 800 m {:.3f} %", 100 * far.translation)
      : near.count > 0 ? fmt::format("; segments of 10 to 50 m {:.3f} %", 100 * near.translation)
                       : "";
  progress->say(
      fmt::format("against the mock's truth over {:.1f} m: ATE {:.3f} m{}{}", e.path_reference,
                  e.ate_se3.rmse, segments,
                  devices_.ins() != nullptr
                      ? " (the report compares with the INS, whose own errors are in its figures)"
                      : ""));
}

ExitCode Drive::verdict(const SessionTotals& totals, const std::vector<std::string>& faults,
                        Progress* progress) const {
  if (totals.ok + totals.degraded == 0) {
    progress->say("vergence: there never was a pose; events.jsonl and poses.csv in " +
                  request_.out.string() + " say why");
    return ExitCode::not_usable;
  }
  if (!source_->missing().empty()) {
    progress->say(fmt::format("vergence: camera {} was gone at the end; check its cable and power",
                              fmt::join(source_->missing(), ", ")));
    return ExitCode::device_failed;
  }
  if (devices_.ins() != nullptr && comparison_->matches() == 0) {
    progress->say(
        "vergence: the INS never had a position for a frame: nothing is compared; the poses are "
        "there");
    return ExitCode::not_usable;
  }
  return faults.empty() ? ExitCode::done : ExitCode::not_usable;
}

ExitCode Drive::run() {
  make_session_folder(request_.out);
  constexpr double kUnknownDrive = 3600;  // s, memory for as long where nobody knows how long it is
  const std::size_t frames =
      devices_.frames() > 0 ? devices_.frames()
                            : static_cast<std::size_t>(kUnknownDrive * configuration_.trigger.rate);
  Recorder::Options to_record;
  to_record.when_full = request_.fast ? Recorder::WhenFull::wait : Recorder::WhenFull::drop;
  to_record.expected_frames = frames;
  to_record.ins = devices_.ins() != nullptr;
  to_record.keep = calibration_keeper(request_.out, begin_.file, begin_.state);
  const auto scheduled = devices_.faults();
  const auto is_full = [](const mock::Fault& f) { return f.kind == mock::FaultKind::disk_full; };
  if (std::any_of(scheduled.begin(), scheduled.end(), is_full))
    to_record.disk_full = [this, scheduled, is_full](Stamp stamp) {
      return std::any_of(scheduled.begin(), scheduled.end(), [&](const mock::Fault& f) {
        return is_full(f) && f.active(stamp - start_);
      });
    };
  recorder_ = std::make_unique<Recorder>(request_.out, to_record);
  journal_.open(recorder_.get(), start_);
  comparison_->open(recorder_.get());
  std::vector<std::string> faults;
  begin_session(request_.out, begin_, start_, recorder_.get(), &faults);
  if (request_.print_memory) print_memory_table(memory());

  Progress progress = Progress::on_stderr(request_.quiet);
  for (const std::string& sentence : begin_.remarks) progress.say("vergence: " + sentence);
  const auto allocations_before = AllocationGuard::allocations_after_seal();
  for (const std::string& remark : devices_.remarks()) {
    progress.say("vergence: " + remark);
    journal_.tell(start_, "device", remark, false);
  }
  const SyncMode mode = devices_.sync().mode;
  journal_.tell(start_, "pairing", proof_sentence(mode), false);
  if (mode == SyncMode::software)
    progress.say(std::string("vergence: ") + proof_sentence(mode) +
                 "; poses in motion suffer from it");
  begin();
  if (!truth_.empty()) write_truth(&faults);
  std::thread estimating([this] { estimate(); });
  watch(&progress);
  estimating.join();
  source_->join();
  if (devices_.mock() != nullptr &&
      devices_.board_keeps_own_time()) {  // whose pulses nobody knew before they were made
    truth_ = true_trajectory(*devices_.mock(), configuration_, start_);
    write_truth(&faults);
  }
  if (exposure_) exposure_->settle();
  progress.finish();
  if (exposure_ && exposure_->counters().unsupported)
    progress.say(
        "vergence: exposure.mode is auto, but a camera cannot change its exposure while it "
        "streams; set it to fixed");

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
  ExitCode code = verdict(*totals, faults, &progress);
  if (code == ExitCode::done && !usable) code = ExitCode::not_usable;
  return signals_.stop_code().value_or(code);
}

void Drive::begin() {
  const HostStamp assumed = devices_.start();
  source_->start();
  start_ = start_ + (devices_.start() - assumed);  // a mock in real time knows it only now
  if (devices_.mock() != nullptr && !devices_.board_keeps_own_time())
    truth_ = true_trajectory(*devices_.mock(), configuration_, start_);
}

}  // namespace

ExitCode run_drive(const RunRequest& request) {
  std::unique_ptr<Drive> drive;
  try {
    drive = std::make_unique<Drive>(request);
  } catch (const std::invalid_argument& e) {  // options and rig do not go together
    throw InputError(e.what());
  } catch (const std::length_error& e) {
    throw InputError(e.what());
  }
  return drive->run();
}

}  // namespace vergence::app
