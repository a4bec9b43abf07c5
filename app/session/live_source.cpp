#include "app/session/live_source.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "app/devices/camera_masks.hpp"
#include "app/devices/drive_sync.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/session/records.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

// 2020-01-01 00:00 UTC, so that every run in virtual time has the same stamps.
constexpr Stamp kVirtualEpoch{1'577'836'800'000'000'000};

std::vector<std::string> list_serials(const std::vector<CameraDevice*>& cameras) {
  std::vector<std::string> serials;
  serials.reserve(cameras.size());
  for (const CameraDevice* camera : cameras) serials.push_back(camera->info().serial);
  return serials;
}

SourceEvent make_event(Stamp stamp, const TimingMonitor::Message& message) noexcept {
  SourceEvent event;
  event.record.stamp = stamp;
  event.record.kind = message.kind;
  event.record.set_message(message.text.data());
  event.to_user = message.to_user;
  return event;
}

}  // namespace

LiveSource::LiveSource(const RunRequest& request)
    : request_(request),
      configuration_(request.configuration),
      devices_(request.configuration, request.faults, request.fast, request.duration_s),
      time_(devices_.sync().mode, request.fast),
      fault_logged_(devices_.faults().size(), false) {
  facts_.begin =
      starting_calibration(configuration_, request.calibration, list_serials(devices_.cameras()));
  make_acquisition();
  make_facts();
}

void LiveSource::make_acquisition() {
  Acquisition::Options o = devices_.acquisition_options();
  o.stamp_grid = stamp_grid(configuration_);
  const HostMoment tie = request_.fast ? HostMoment{kVirtualEpoch, devices_.start()} : moment_now();
  o.tie_stamp = tie.day;
  o.tie_host = tie.host;
  if (exposes_by_itself(configuration_)) {
    const CameraSettings& c = configuration_.cameras[0];
    const CameraMasks masks(configuration_, facts_.begin.file.rig);
    exposure_ = std::make_unique<ExposureControl>(
        devices_.cameras(), c.width, c.height, masks.views()[0], exposure_options(configuration_),
        starting_exposure(configuration_, 0), request_.fast);
  }
  if (!request_.fast) facts_.tie = ClockTie{o.tie_stamp, o.tie_host};
  o.frame_observer = exposure_.get();
  acquisition_ =
      std::make_unique<Acquisition>(devices_.cameras(), devices_.ins(), devices_.trigger(), o);
  start_ = o.tie_stamp + (devices_.start() - o.tie_host);
  // In real time the drive's start is known only when the devices are; the session's is now.
  facts_.first = request_.fast ? start_ : o.tie_stamp;
}

void LiveSource::make_facts() {
  facts_.adoption = request_.fast ? Adoption::after_fixed_frames : Adoption::when_ready;
  if (!request_.fast) facts_.frame_interval = Duration::seconds(1.0 / configuration_.trigger.rate);
  facts_.when_full = request_.fast ? WhenFull::wait : WhenFull::drop;
  facts_.frames = devices_.frames();
  if (devices_.ins() != nullptr)
    facts_.ins =
        SourceIns{comparison_options(configuration_), InsSource::device, "the configuration", 0};
  const auto is_full = [](const mock::Fault& f) { return f.kind == mock::FaultKind::disk_full; };
  const auto scheduled = devices_.faults();
  if (std::any_of(scheduled.begin(), scheduled.end(), is_full))
    facts_.disk_full = [this, scheduled, is_full](Stamp stamp) {
      return std::any_of(scheduled.begin(), scheduled.end(), [&](const mock::Fault& f) {
        return is_full(f) && f.active(stamp - start_);
      });
    };
  for (const std::string& message : facts_.begin.remarks)
    facts_.remarks.push_back({message, "calibration"});
  for (const std::string& message : devices_.remarks())
    facts_.remarks.push_back({message, "device"});
  const SyncMode mode = devices_.sync().mode;
  facts_.remarks.push_back({proof_message(mode), "pairing", false});
  if (mode == SyncMode::approximate_time)
    facts_.remarks.push_back(
        {std::string(proof_message(mode)) + "; poses in motion are less accurate"});
  facts_.knows_truth = devices_.mock() != nullptr;
  facts_.image_bytes = devices_.image_bytes();
  facts_.ring_bytes = sizeof(Acquisition);
  facts_.skipped_label = "dropped";
  facts_.on_request = true;
}

void LiveSource::start(std::vector<std::string>* faults) {
  const HostStamp assumed = devices_.start();
  start_acquisition(acquisition_.get(), pulse_observer_);
  begun_ = std::chrono::steady_clock::now();
  // In real time the simulated rig sets its start only now.
  start_ = start_ + (devices_.start() - assumed);
  if (devices_.mock() == nullptr) return;
  truth_ = true_trajectory(*devices_.mock(), configuration_, start_);
  if (!truth_.empty()) write_truth(faults);
}

// ---- the estimator's thread

bool LiveSource::next(SourceItem* item) noexcept {
  while (true) {
    if (waiting_) {
      if (next_event(item)) return true;
      waiting_ = false;
      const auto* frame = std::get_if<AcquiredFrame>(&in_hand_);
      *item = SourceFrame{frame->rig, 0};
      return true;
    }
    if (const auto* reading = std::get_if<InsRecord>(&in_hand_)) {
      const TimingMonitor::Message message = time_.of_reading(*reading);
      const Stamp stamp = reading->sample.stamp;
      in_hand_ = DeviceEvent{};
      if (message.kind != nullptr) {
        *item = make_event(stamp, message);
        return true;
      }
    }
    if (!acquisition_->next(&in_hand_)) return false;
    if (const auto* frame = std::get_if<AcquiredFrame>(&in_hand_)) {
      waiting_ = true;
      const TimingMonitor::Message message = time_.of_set(frame->set);
      if (message.kind == nullptr) continue;
      *item = make_event(frame->rig.stamp, message);
      return true;
    }
    if (const auto* reading = std::get_if<InsRecord>(&in_hand_)) {
      *item = *reading;
      return true;
    }
    const auto* event = std::get_if<DeviceEvent>(&in_hand_);
    *item = make_event(event->stamp, time_.of_device(*event));
    return true;
  }
}

/// The mock's faults that have begun by the frame in hand.
bool LiveSource::next_event(SourceItem* item) noexcept {
  const Stamp stamp = std::get_if<AcquiredFrame>(&in_hand_)->rig.stamp;
  const auto faults = devices_.faults();
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (fault_logged_[i] || stamp < start_ + faults[i].at) continue;
    fault_logged_[i] = true;
    std::array<char, 96> text{};
    const std::string_view kind = mock::to_string(faults[i].kind);
    (void)std::snprintf(text.data(), text.size(), "%.*s, as scheduled",
                        static_cast<int>(kind.size()), kind.data());
    SourceEvent event;
    event.record.stamp = start_ + faults[i].at;
    event.record.kind = "fault";
    event.record.set_message(text.data());
    event.recalibrate = faults[i].kind == mock::FaultKind::recalibrate;
    *item = event;
    return true;
  }
  return false;
}

void LiveSource::done(const PoseSample& sample) noexcept {
  const auto* frame = std::get_if<AcquiredFrame>(&in_hand_);
  time_.record_pose(*frame, sample.estimate_ms, request_.fast ? HostStamp{} : monotonic_now());
  acquisition_->release(*frame);
}

// ---- the caller's thread

void LiveSource::poll() {
  // A simulated device always has a next delivery, and in virtual time polling advances it.
  if (devices_.mock() == nullptr) acquisition_->wake();
  if (request_.duration_s && !request_.fast && std::chrono::steady_clock::now() > end())
    acquisition_->stop();
}

/// Real cameras do not end by themselves. A mock's do, after their last pulse, which a loaded
/// machine brings late; but not if they are disconnected by then.
std::chrono::steady_clock::time_point LiveSource::end() const {
  constexpr std::chrono::seconds kLate{3};
  const std::chrono::duration<double> drive(*request_.duration_s);
  return begun_ + std::chrono::ceil<std::chrono::steady_clock::duration>(drive) +
         (devices_.mock() != nullptr ? kLate : std::chrono::seconds(0));
}

void LiveSource::halt() noexcept { acquisition_->join(); }

void LiveSource::finish(Progress* progress, std::vector<std::string>* /*faults*/) {
  if (exposure_) exposure_->settle();
  if (exposure_ && exposure_->counters().unsupported)
    progress->print(
        "vergence: exposure.mode is auto, but a camera cannot change its exposure while streaming: "
        "set exposure.mode to fixed");
}

void LiveSource::write_truth(std::vector<std::string>* faults) const {
  try {
    LineFile file(request_.session.out / "truth.tum");
    // Number of lines per flush, a tenth of the file's buffer.
    constexpr std::size_t kTogether = 1000;
    std::size_t lines = 0;
    std::string line;
    for (const StampedPose& pose : truth_) {
      format_tum(pose.stamp, pose.T_world_body, &line);
      (void)file.append(line);
      if (++lines % kTogether == 0) (void)file.flush();
    }
    if (!file.close() || file.lost_lines() > 0)
      faults->push_back(file.path().string() + ": incomplete; free space on that disk");
  } catch (const InputError& e) {
    faults->emplace_back(e.what());
  }
}

std::vector<std::pair<std::string, std::uint64_t>> LiveSource::counters() const {
  const AcquisitionCounters& c = acquisition_->counters();
  std::vector<std::pair<std::string, std::uint64_t>> out{
      {"sets_complete", c.sync.complete},
      {"sets_incomplete", c.sync.incomplete},
      {"pulses_missed", c.sync.missed},
      {"sets_superseded", c.dropped_sets},
      {"readings_dropped", c.dropped_readings},
      {"frames_incomplete", c.incomplete},
      {"sets_ambiguous", c.sync.ambiguous},
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
  for (int k = 0; k < facts_.begin.file.rig.cameras; ++k) {
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

TruthMetrics LiveSource::truth_metrics(const SessionTotals& totals,
                                       const Estimator& estimator) const {
  TruthMetrics metrics;
  if (totals.trajectory.empty() || devices_.mock() == nullptr) return metrics;
  metrics.evaluation = evaluate(totals.trajectory, truth_, summary_evaluation_options());
  if (estimator.calibrated())
    metrics.calibration_error = calibration_errors(
        estimator.calibration(),
        devices_.mock()->truth().calibration(totals.trajectory.back().stamp - start_));
  return metrics;
}

void LiveSource::describe(const SessionTotals& totals, const Estimator& estimator,
                          SummaryInput* input) const {
  const AcquisitionCounters& c = acquisition_->counters();
  // Pulses whose images were not used: of some no set came, because nothing proved yet
  // which images were theirs.
  const auto acquiring = std::min_element(c.sync.acquiring.begin(),
                                          c.sync.acquiring.begin() + facts_.begin.file.rig.cameras);
  input->skipped = c.dropped_sets + c.sync.missed + *acquiring;
  input->devices = counters();
  input->time = time_.json(c, devices_);
  if (devices_.mock() != nullptr) input->truth = truth_metrics(totals, estimator);
}

void LiveSource::print_metrics(const SessionTotals& /*totals*/, const SummaryInput& input,
                               Progress* progress) const {
  if (!input.truth || !input.truth->evaluation ||
      input.truth->evaluation->status != EvaluationStatus::ok)
    return;
  const TrajectoryEvaluation& e = *input.truth->evaluation;
  const SegmentErrors &far = e.segments[0], &near = e.segments[1];
  const std::string segments =
      far.count > 0    ? fmt::format("; segments of 100 to 800 m {:.3f} %", 100 * far.translation)
      : near.count > 0 ? fmt::format("; segments of 10 to 50 m {:.3f} %", 100 * near.translation)
                       : "";
  progress->print(fmt::format("error against ground truth over {:.1f} m: ATE {:.3f} m{}{}",
                              e.path_reference, e.ate_se3.rmse, segments,
                              devices_.ins() != nullptr
                                  ? " (the report compares with the INS, including its errors)"
                                  : ""));
}

std::optional<ExitCode> LiveSource::verdict(Progress* progress) const {
  if (acquisition_->missing().empty()) return std::nullopt;
  progress->print(
      fmt::format("vergence: camera {} was disconnected at the end; check its cable and power",
                  fmt::join(acquisition_->missing(), ", ")));
  return ExitCode::device_failed;
}

ExitCode run_drive(const RunRequest& request) {
  // Signals are handled before the simulated world is rendered, which takes seconds.
  const SignalGuard signals;
  try {
    const auto source = with_plain_errors([&] { return std::make_unique<LiveSource>(request); });
    // A signal may arrive while devices are opened, which takes seconds.
    if (const auto stopped = signals.stop_code()) return *stopped;
    return run_session(*source, request.configuration, request.session, signals);
  } catch (const DeviceError&) {
    // After a stop by the user a missing device is no error.
    if (const auto stopped = signals.stop_code()) return *stopped;
    throw;
  }
}

}  // namespace vergence::app
