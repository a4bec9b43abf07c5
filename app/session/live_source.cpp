#include "app/session/live_source.hpp"

#include "app/devices/camera_masks.hpp"
#include "app/devices/drive_devices.hpp"
#include "app/devices/drive_sync.hpp"
#include "app/devices/exposure_control.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/runtime/durable_file.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

// 2020-01-01 00:00 UTC, so that every run in virtual time has the same stamps.
constexpr Stamp kVirtualEpoch{1'577'836'800'000'000'000};

using Json = nlohmann::ordered_json;

constexpr double kMicroseconds = 1e6;

double us(Duration d) { return d.to_seconds() * kMicroseconds; }

const char* fix_name(FixStatus fix) noexcept {
  constexpr std::array kNames{"no position", "dead reckoning", "a fix without height", "a fix"};
  return kNames[static_cast<std::size_t>(fix)];
}

/// Representation of a device event in events.jsonl.
struct DeviceReport {
  const char* kind;
  bool to_user;
  // Format of the message: {0} is the camera, {1} the seconds.
  const char* text;
};
/// In the order of DeviceEvent::Kind.
constexpr std::array kDeviceReports{
    DeviceReport{"camera_disconnected", true,
                 "camera {0} is disconnected; the run continues without it"},
    DeviceReport{"camera_reconnected", true, "camera {0} is reconnected"},
    DeviceReport{"trigger_board_disconnected", true,
                 "the trigger board is disconnected: check its cable; reconnecting every second"},
    DeviceReport{"trigger_board_reconnected", true, "the trigger board is reconnected"},
    DeviceReport{"trigger_board_restarted", true,
                 "the trigger board restarted: its pulses count from 0; the pairing is being "
                 "verified again"},
    DeviceReport{"pairing_pending", false,
                 "images of camera {0} are not used until their pulses are identified"},
    DeviceReport{"pairing_verified", false,
                 "the pairing of camera {0} is verified after {1:.2f} s"}};

/// Three digits after the point: nanoseconds of microseconds, and a thousandth of a ppm.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

Json clock_json(const std::string& device, const ClockRecord& clock) {
  return {{"device", device},
          {"stamps", clock.stamps()},
          {"drift_ppm", rounded(clock.drift_ppm())},
          {"error_us", rounded(us(clock.error()))},
          {"worst_error_us", rounded(us(clock.worst_error()))}};
}

SourceEvent event_of_device(const DeviceEvent& event) noexcept {
  const DeviceReport& report = kDeviceReports[static_cast<std::size_t>(event.kind)];
  return {
      EventRecord(event.stamp, report.kind, fmt::runtime(report.text), event.camera, event.seconds),
      report.to_user};
}

std::vector<std::string> list_serials(const std::vector<CameraDevice*>& cameras) {
  std::vector<std::string> serials;
  serials.reserve(cameras.size());
  for (const CameraDevice* camera : cameras) serials.push_back(camera->info().serial);
  return serials;
}

/// The devices of a configuration as the source of a session: cameras, INS and board, real or a
/// mock's.
///
/// Ownership  Holds the devices. `request` outlives it.
/// Errors     The constructor throws InputError: configuration; DeviceError: devices that are not
///            there.
class LiveSource final : public FrameSource {
 public:
  explicit LiveSource(const RunRequest& request)
      : request_(request),
        configuration_(request.configuration),
        devices_(request.configuration, request.faults, request.fast, request.duration_s),
        fault_logged_(devices_.faults().size(), false) {
    facts_.begin =
        starting_calibration(configuration_, request.calibration, list_serials(devices_.cameras()));
    make_acquisition();
    make_facts();
  }

  void observe_pulses(PulseObserver* observer) override { pulse_observer_ = observer; }
  void start(std::vector<std::string>* faults) override {
    const HostStamp assumed = devices_.start();
    start_acquisition(acquisition_.get(), pulse_observer_);
    begun_ = std::chrono::steady_clock::now();
    // In real time the simulated rig sets its start only now.
    start_ = start_ + (devices_.start() - assumed);
    if (devices_.mock() == nullptr) return;
    truth_ = true_trajectory(*devices_.mock(), configuration_, start_);
    if (!truth_.empty()) write_truth(faults);
  }
  [[nodiscard]] bool next(SourceItem* item) noexcept override {
    for (;;) {
      if (waiting_) {
        const auto& frame = std::get<AcquiredFrame>(in_hand_);
        waiting_ = next_event(frame, item);
        if (!waiting_) *item = SourceFrame{frame.rig, 0};
        return true;
      }
      if (const auto* reading = std::get_if<InsRecord>(&in_hand_)) {
        const auto event = event_of_reading(*reading);
        in_hand_ = DeviceEvent{};
        if (event) {
          *item = *event;
          return true;
        }
      }
      if (!acquisition_->next(&in_hand_)) return false;
      waiting_ = std::holds_alternative<AcquiredFrame>(in_hand_);
      if (waiting_) continue;
      if (const auto* reading = std::get_if<InsRecord>(&in_hand_))
        *item = *reading;
      else
        *item = event_of_device(std::get<DeviceEvent>(in_hand_));
      return true;
    }
  }
  void done(const PoseSample& sample) noexcept override {
    const auto* frame = std::get_if<AcquiredFrame>(&in_hand_);
    const SyncedSet& set = frame->set;
    latency_.add(request_.fast
                     ? (set.arrival - set.stamp).to_seconds() * 1e3 + double{sample.estimate_ms}
                     : (monotonic_now() - set.stamp).to_seconds() * 1e3);
    acquisition_->release(*frame);
  }
  void stop() noexcept override { acquisition_->stop(); }
  [[nodiscard]] std::uint64_t rounds() const noexcept override { return acquisition_->rounds(); }
  void poll() override {
    // A simulated device always has a next delivery, and in virtual time polling advances it.
    if (devices_.mock() == nullptr) acquisition_->wake();
    if (request_.duration_s && !request_.fast && std::chrono::steady_clock::now() > end())
      acquisition_->stop();
  }
  void halt() noexcept override { acquisition_->join(); }
  void finish(Progress* progress) override {
    if (exposure_) exposure_->settle();
    if (exposure_ && exposure_->counters().unsupported)
      progress->print(
          "vergence: exposure.mode is auto, but a camera cannot change its exposure while "
          "streaming: set exposure.mode to fixed");
  }
  void describe(const SessionTotals& totals, const Estimator& estimator,
                SummaryInput* input) const override {
    const AcquisitionCounters& c = acquisition_->counters();
    // Pulses whose images were not used: of some no set came, because nothing proved yet
    // which images were theirs.
    const auto acquiring = std::min_element(
        c.sync.acquiring.begin(), c.sync.acquiring.begin() + facts_.begin.file.rig.cameras);
    input->skipped = c.dropped_sets + c.sync.missed + *acquiring;
    input->devices = counters();
    input->time = time_json(c);
    if (devices_.mock() != nullptr) input->truth = truth_metrics(totals, estimator);
  }
  void print_metrics(const SummaryInput& input, Progress* progress) const override {
    if (input.truth) print_evaluation("ground truth", input.truth->evaluation, progress);
  }
  [[nodiscard]] std::optional<ExitCode> verdict(Progress* progress) const override {
    if (acquisition_->missing().empty()) return std::nullopt;
    progress->print("vergence: camera {} was disconnected at the end; check its cable and power",
                    fmt::join(acquisition_->missing(), ", "));
    return ExitCode::device_failed;
  }

 private:
  // Time when the run ends, if it has a duration.
  [[nodiscard]] std::chrono::steady_clock::time_point end() const {
    constexpr std::chrono::seconds kLate{3};
    const std::chrono::duration<double> drive(*request_.duration_s);
    return begun_ + std::chrono::ceil<std::chrono::steady_clock::duration>(drive) +
           (devices_.mock() != nullptr ? kLate : std::chrono::seconds(0));
  }
  void make_facts() {
    facts_.adoption = request_.fast ? Adoption::after_fixed_frames : Adoption::when_ready;
    if (!request_.fast)
      facts_.frame_interval = Duration::seconds(1.0 / configuration_.trigger.rate);
    facts_.when_full = request_.fast ? WhenFull::wait : WhenFull::drop;
    facts_.frames = devices_.frames();
    if (devices_.ins() != nullptr)
      facts_.ins =
          SourceIns{comparison_options(configuration_), InsSource::device, "the configuration", 0};
    const auto is_full = [](const mock::Fault& f) { return f.kind == mock::FaultKind::disk_full; };
    const auto scheduled = devices_.faults();
    if (std::ranges::any_of(scheduled, is_full))
      facts_.disk_full = [this, scheduled, is_full](Stamp stamp) {
        return std::ranges::any_of(scheduled, [&](const mock::Fault& f) {
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
  void make_acquisition() {
    Acquisition::Options o = devices_.acquisition_options();
    o.stamp_grid = stamp_grid(configuration_);
    const HostMoment tie =
        request_.fast ? HostMoment{kVirtualEpoch, devices_.start()} : moment_now();
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
  /// An event that goes before the frame in hand. False: none is left.
  [[nodiscard]] bool next_event(const AcquiredFrame& frame, SourceItem* item) noexcept {
    if (const auto event = event_of_set(frame)) {
      *item = *event;
      return true;
    }
    const auto faults = devices_.faults();
    for (std::size_t i = 0; i < faults.size(); ++i) {
      if (fault_logged_[i] || frame.rig.stamp < start_ + faults[i].at) continue;
      fault_logged_[i] = true;
      *item = SourceEvent{.record = {start_ + faults[i].at, "fault", "{}, as scheduled",
                                     mock::to_string(faults[i].kind)},
                          .recalibrate = faults[i].kind == mock::FaultKind::recalibrate};
      return true;
    }
    return false;
  }
  /// Event of a set that was handed out, if a run of ambiguous ones begins with it.
  std::optional<SourceEvent> event_of_set(const AcquiredFrame& frame) noexcept {
    const bool was = std::exchange(ambiguous_, frame.set.proof == SyncProof::ambiguous);
    if (was || !ambiguous_) return std::nullopt;
    return SourceEvent{
        EventRecord(frame.rig.stamp, "pairing_ambiguous",
                    "ambiguous pair: pulses, counters and stamps contradict each "
                    "other{}",
                    verifies_pairing(devices_.sync().mode) ? "; one image is used alone" : ""),
        true};
  }
  /// Event of an INS sample, if the state of the receiver or the filter has changed, or the offset
  /// of the session's stamps from UTC.
  std::optional<SourceEvent> event_of_reading(const InsRecord& reading) noexcept {
    // Minimum change of the satellite count that is reported.
    constexpr int kMany = 3;
    const InsQuality& q = reading.quality;
    const int count = q.satellites;
    const bool changed = !any_quality_ || q.filter_valid != quality_.filter_valid ||
                         reading.sample.fix != fix_ ||
                         std::abs(count - int{quality_.satellites}) >= kMany;
    if (!changed) return event_of_utc(reading);
    any_quality_ = true;
    quality_ = q;
    fix_ = reading.sample.fix;
    // A device that reports no filter state has no status either.
    const bool given = q.status != 0 || q.filter_valid;
    return SourceEvent{EventRecord(reading.sample.stamp, "ins_status",
                                   "the INS has {}, {} satellites{}", fix_name(fix_), count,
                                   !given           ? ""
                                   : q.filter_valid ? ", filter valid"
                                                    : ", filter not valid")};
  }
  std::optional<SourceEvent> event_of_utc(const InsRecord& reading) noexcept {
    // Minimum clock step in s that is reported.
    constexpr double kStep = 0.1;
    if (!reading.quality.utc_valid || reading.quality.utc_ns == 0) return std::nullopt;
    const double ahead =
        static_cast<double>(reading.sample.stamp.ns() - reading.quality.utc_ns) * 1e-9;
    if (reported_ahead_s_ && std::abs(ahead - *reported_ahead_s_) < kStep) return std::nullopt;
    reported_ahead_s_ = ahead;
    return SourceEvent{EventRecord(reading.sample.stamp, "utc_offset",
                                   "the session's stamps are {:.4f} s {} the INS's UTC; they "
                                   "follow the host clock at the start",
                                   std::abs(ahead), ahead < 0 ? "behind" : "ahead of")};
  }
  /// The block `time` of summary.json.
  [[nodiscard]] Json time_json(const AcquisitionCounters& c) const {
    Json clocks = Json::array();
    const SyncMode mode = devices_.sync().mode;
    const bool verifiable = verifies_pairing(mode);
    bool verified = verifiable;
    for (std::size_t k = 0; k < devices_.cameras().size(); ++k) {
      clocks.push_back(clock_json(fmt::format("camera {}", k), c.cameras[k]));
      verified = verified && c.verified[k];
    }
    if (c.board.stamps() > 0) clocks.push_back(clock_json("board", c.board));
    if (devices_.ins() != nullptr) clocks.push_back(clock_json("INS", c.ins));
    Json latency;
    if (latency_.count() > 0) {
      latency = {{"mean", rounded(latency_.mean())}};
      latency.update(distribution_json(latency_));
      latency["virtual"] = request_.fast;
    }
    return {{"clocks", clocks},
            {"worst_stamp_error_us", rounded(static_cast<double>(c.worst_stamp_error_ns) * 1e-3)},
            {"pairing",
             {{"mode", to_string(mode)},
              {"message", proof_message(mode)},
              {"verifiable", verifiable},
              {"verified", verified},
              {"worst_acquisition_s", rounded(c.sync.worst_acquisition.to_seconds())}}},
            {"latency_ms", latency}};
  }
  void write_truth(std::vector<std::string>* faults) const {
    std::string text, line;
    for (const StampedPose& pose : truth_) {
      format_tum(pose.stamp, pose.T_world_body, &line);
      text += line;
    }
    try {
      replace_durably(request_.session.out / "truth.tum", text);
    } catch (const InputError& e) {
      faults->emplace_back(e.what());
    }
  }
  [[nodiscard]] TruthMetrics truth_metrics(const SessionTotals& totals,
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
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const {
    const AcquisitionCounters& c = acquisition_->counters();
    std::vector<std::pair<std::string, std::uint64_t>> out{
        {"sets_complete", c.sync.complete},     {"sets_incomplete", c.sync.incomplete},
        {"sets_superseded", c.dropped_sets},    {"sets_ambiguous", c.sync.ambiguous},
        {"sets_unreported", c.sync.unreported}, {"sets_pushed_out", c.sync.pushed_out},
        {"frames_incomplete", c.incomplete},    {"readings_dropped", c.dropped_readings},
        {"clock_resets", c.clock_resets},       {"pulses", c.pulses},
        {"pulses_missed", c.sync.missed},       {"pauses", c.pauses},
        {"pauses_refused", c.pauses_refused}};
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
    for (std::size_t k = 0; k < devices_.cameras().size(); ++k) {
      const CameraStatistics s = devices_.cameras()[k]->statistics();
      for (const auto& [what, count] : {std::pair{"delivered", s.delivered},
                                        {"lost", s.lost},
                                        {"underruns", s.underruns},
                                        {"starts", s.starts},
                                        {"unpaired", c.sync.lost[k]},
                                        {"absent", c.sync.absent[k]},
                                        {"duplicate", c.sync.duplicate[k]},
                                        {"late", c.sync.late[k]},
                                        {"missed_trigger", c.sync.missed_trigger[k]},
                                        {"pending", c.sync.acquiring[k]},
                                        {"acquisitions", c.sync.acquisitions[k]},
                                        {"contradictions", c.sync.contradictions[k]}})
        out.emplace_back(fmt::format("camera{}_{}", k, what), count);
    }
    if (devices_.ins() != nullptr) {
      const InsStatistics s = devices_.ins()->statistics();
      out.insert(out.end(), {{"ins_lost", s.lost},
                             {"ins_malformed", s.malformed},
                             {"ins_restarts", s.restarts},
                             {"ins_overruns", s.overruns}});
    }
    if (devices_.trigger() != nullptr) {
      const TriggerStatistics s = devices_.trigger()->statistics();
      out.insert(out.end(), {{"board_pulses", s.pulses},
                             {"board_lost", s.lost},
                             {"board_malformed", s.malformed},
                             {"board_overruns", s.overruns},
                             {"board_reboots", c.reboots},
                             {"board_starts", s.starts}});
    }
    return out;
  }

  const RunRequest& request_;
  const Configuration& configuration_;
  DriveDevices devices_;
  // Null if exposures are fixed.
  std::unique_ptr<ExposureControl> exposure_;
  // Null if pulses are not recorded.
  PulseObserver* pulse_observer_ = nullptr;
  std::unique_ptr<Acquisition> acquisition_;
  // First stamp of the run.
  Stamp start_{};
  std::chrono::steady_clock::time_point begun_{};
  std::vector<StampedPose> truth_;

  // Used by the estimator's thread; read by others after it has joined.
  TimeHistogram latency_;
  // True if the last set was ambiguous.
  bool ambiguous_ = false;
  // Quality reported last.
  InsQuality quality_{};
  FixStatus fix_ = FixStatus::none;
  bool any_quality_ = false;
  // Last reported lead of the session's stamps over the INS's UTC, in s.
  std::optional<double> reported_ahead_s_{};
  std::vector<bool> fault_logged_;
  // Last item returned, or the one that waits until its events have been returned.
  Acquired in_hand_{};
  // True if `in_hand_` is a frame that was not returned yet.
  bool waiting_ = false;
};

}  // namespace

ExitCode run_drive(const RunRequest& request) {
  // Signals are handled before the simulated world is rendered, which takes seconds.
  const SignalGuard signals;
  try {
    LiveSource source(request);
    // A signal may arrive while devices are opened, which takes seconds.
    if (const auto stopped = signals.stop_code()) return *stopped;
    return run_session(source, request.configuration, request.session, signals);
  } catch (const DeviceError&) {
    // After a stop by the user a missing device is no error.
    if (const auto stopped = signals.stop_code()) return *stopped;
    throw;
  }
}

}  // namespace vergence::app
