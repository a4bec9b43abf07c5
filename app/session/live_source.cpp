#include "app/session/live_source.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/devices/camera_masks.hpp"
#include "app/devices/drive_devices.hpp"
#include "app/devices/drive_sync.hpp"
#include "app/devices/exposure_control.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/session/records.hpp"
#include "app/session/session_totals.hpp"
#include "core/memory/ring.hpp"
#include "drivers/acquisition/acquisition.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

constexpr Stamp kVirtualEpoch{
    1'577'836'800'000'000'000};  // 2020-01-01 00:00 UTC: a drive in virtual time has the same
                                 // stamps on every run

std::vector<std::string> list_serials(const std::vector<CameraDevice*>& cameras) {
  std::vector<std::string> serials;
  serials.reserve(cameras.size());
  for (const CameraDevice* camera : cameras) serials.push_back(camera->info().serial);
  return serials;
}

constexpr double kMicroseconds = 1e6;

double us(Duration d) { return d.to_seconds() * kMicroseconds; }

/// Event of a DeviceEvent::Kind; `{0}` is the camera, `{1}` the seconds.
struct DeviceMessage {
  const char* kind;
  bool to_user;
  const char* format;
};
constexpr std::array kDeviceMessages{
    DeviceMessage{"camera_disconnected", true,
                  "camera {0} is disconnected; the run continues without it"},
    DeviceMessage{"camera_reconnected", true, "camera {0} is reconnected"},
    DeviceMessage{"trigger_board_disconnected", true,
                  "the trigger board is disconnected: check its cable; reconnecting every second"},
    DeviceMessage{"trigger_board_reconnected", true, "the trigger board is reconnected"},
    DeviceMessage{"trigger_board_restarted", true,
                  "the trigger board restarted: its pulses count from 0; the pairing is being "
                  "verified again"},
    DeviceMessage{"pairing_pending", false,
                  "images of camera {0} are not used until their pulses are identified"},
    DeviceMessage{"pairing_verified", false,
                  "the pairing of camera {0} is verified after {1:.2f} s"}};
static_assert(kDeviceMessages.size() ==
              static_cast<std::size_t>(DeviceEvent::Kind::pairing_verified) + 1);

const char* fix_name(FixStatus fix) noexcept {
  constexpr std::array kNames{"no position", "dead reckoning", "a fix without height", "a fix"};
  return kNames[static_cast<std::size_t>(fix)];
}

using Json = nlohmann::ordered_json;

/// Three digits after the point: nanoseconds of microseconds, and a thousandth of a ppm.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

Json clock_json(const std::string& device, const ClockRecord& clock) {
  return {{"device", device},
          {"stamps", clock.stamps()},
          {"drift_ppm", rounded(clock.drift_ppm())},
          {"error_us", rounded(us(clock.error()))},
          {"worst_error_us", rounded(us(clock.worst_error()))}};
}

Json latency_json(const TimeHistogram& latency, bool is_virtual) {
  if (latency.count() == 0) return nullptr;
  return {{"mean", rounded(latency.mean())},
          {"p50", rounded(latency.percentile(0.5))},
          {"p99", rounded(latency.percentile(0.99))},
          {"p99_9", rounded(latency.percentile(0.999))},
          {"max", rounded(latency.max())},
          {"virtual", is_virtual}};
}

/// Timing of a session: clocks, pairing, latencies, its stamps against the INS's UTC. Events
/// as messages, figures for summary.json.
///
/// Threads  note…(): the estimator's, sealed. json(): any, after that has joined. Memory: fixed;
///          messages are in place.
class TimingMonitor {
 public:
  explicit TimingMonitor(SyncMode mode, bool virtual_time) : mode_(mode), virtual_(virtual_time) {}

  /// Message of a device event.
  [[nodiscard]] SourceEvent of_device(const DeviceEvent& event) const noexcept {
    const DeviceMessage& m = kDeviceMessages[static_cast<std::size_t>(event.kind)];
    return {
        EventRecord::make(event.stamp, m.kind, fmt::runtime(m.format), event.camera, event.seconds),
        m.to_user};
  }

  /// A set that was handed out: tells when a run of ambiguous ones begins.
  [[nodiscard]] std::optional<SourceEvent> of_set(const AcquiredFrame& frame) noexcept {
    const bool was = ambiguous_;
    ambiguous_ = frame.set.proof == SyncProof::ambiguous;
    if (was || !ambiguous_) return {};
    return SourceEvent{
        EventRecord::make(frame.rig.stamp, "pairing_ambiguous",
                          "ambiguous pair: pulses, counters and stamps contradict each other{}",
                          verifies_pairing(mode_) ? "; one image is used alone" : ""),
        true};
  }

  /// A reading: tells when what the receiver and the filter say has changed, and of the
  /// session's stamps against UTC.
  [[nodiscard]] std::optional<SourceEvent> of_reading(const InsRecord& reading) noexcept {
    constexpr int kMany = 3;  // satellites: one more or less is not worth a word
    const InsQuality& q = reading.quality;
    const int count = q.satellites;
    const bool changed = !any_quality_ || q.filter_valid != quality_.filter_valid ||
                         reading.sample.fix != fix_ ||
                         std::abs(count - int{quality_.satellites}) >= kMany;
    if (!changed) return of_utc(reading);
    any_quality_ = true;
    quality_ = q;
    fix_ = reading.sample.fix;
    // A device that sends nothing about its filter has no status either.
    const char* filter = q.filter_valid  ? ", filter valid"
                         : q.status != 0 ? ", filter not valid"
                                         : "";
    const Stamp stamp = reading.sample.stamp;
    const EventRecord event =
        count > 0
            ? EventRecord::make(stamp, "ins_status", "the INS has {}, {} satellites{}",
                                fix_name(fix_), count, filter)
            : EventRecord::make(stamp, "ins_status", "the INS has {}{}", fix_name(fix_), filter);
    return SourceEvent{event};
  }

  /// A pose of these images has gone out. `estimate_ms`: what it took; `now`: by the host's clock,
  /// meaningless in virtual time.
  void record_pose(const AcquiredFrame& frame, float estimate_ms, HostStamp now) noexcept {
    const SyncedSet& set = frame.set;
    const double ms =
        virtual_ ? (set.arrival - set.stamp).to_seconds() * 1e3 + static_cast<double>(estimate_ms)
                 : (now - set.stamp).to_seconds() * 1e3;
    latency_.add(ms);
  }

  /// The block `time` of summary.json.
  [[nodiscard]] nlohmann::ordered_json json(const AcquisitionCounters& c,
                                            const DriveDevices& devices) const {
    Json clocks = Json::array(), board = Json::object(), ins = Json::object(),
         cameras = Json::array();
    bool all_verified = verifies_pairing(mode_);
    for (std::size_t k = 0; k < devices.cameras().size(); ++k) {
      clocks.push_back(clock_json(fmt::format("camera {}", k), c.cameras[k]));
      const CameraStatistics s = devices.cameras()[k]->statistics();
      all_verified = all_verified && c.verified[k];
      cameras.push_back({{"verified", verifies_pairing(mode_) && c.verified[k]},
                         {"acquisitions", c.sync.acquisitions[k]},
                         {"losses",
                          {{"missed_trigger", c.sync.missed_trigger[k]},
                           {"lost", c.sync.lost[k]},
                           {"pairing_pending", c.sync.acquiring[k]},
                           {"contradictions", c.sync.contradictions[k]},
                           {"late", c.sync.late[k]},
                           {"duplicate", c.sync.duplicate[k]},
                           {"absent", c.sync.absent[k]},
                           {"incomplete", s.torn},
                           {"underruns", s.underruns}}}});
    }
    if (c.board.stamps() > 0) clocks.push_back(clock_json("board", c.board));
    if (devices.ins() != nullptr) {
      clocks.push_back(clock_json("INS", c.ins));
      const InsStatistics s = devices.ins()->statistics();
      ins = {{"lost", s.lost},
             {"malformed", s.malformed},
             {"restarts", s.restarts},
             {"overruns", s.overruns},
             {"dropped", c.dropped_readings}};
    }
    if (devices.trigger() != nullptr) {
      const TriggerStatistics s = devices.trigger()->statistics();
      board = {{"pulses", s.pulses},     {"lost", s.lost},       {"malformed", s.malformed},
               {"overruns", s.overruns}, {"reboots", c.reboots}, {"starts", s.starts}};
    }
    const Json pairing = {{"mode", to_string(mode_)},
                          {"message", proof_message(mode_)},
                          {"verifiable", verifies_pairing(mode_)},
                          {"verified", all_verified},
                          {"worst_acquisition_s", rounded(c.sync.worst_acquisition.to_seconds())},
                          {"pauses", c.pauses},
                          {"pauses_refused", c.pauses_refused},
                          {"sets",
                           {{"complete", c.sync.complete},
                            {"incomplete", c.sync.incomplete},
                            {"ambiguous", c.sync.ambiguous},
                            {"unreported", c.sync.unreported},
                            {"pulses", c.pulses},
                            {"pulses_missed", c.sync.missed},
                            {"pushed_out", c.sync.pushed_out},
                            {"overtaken", c.dropped_sets},
                            {"incomplete", c.torn}}},
                          {"cameras", cameras}};
    return {{"clocks", clocks},
            {"clock_resets", c.clock_resets},
            {"worst_stamp_error_us", rounded(static_cast<double>(c.worst_stamp_error_ns) * 1e-3)},
            {"pairing", pairing},
            {"board", board},
            {"ins", ins},
            {"latency_ms", latency_json(latency_, virtual_)}};
  }

 private:
  [[nodiscard]] std::optional<SourceEvent> of_utc(const InsRecord& reading) noexcept {
    constexpr double kStep = 0.1;  // s: a clock that was set
    if (!reading.quality.utc_valid || reading.quality.utc_ns == 0) return {};
    const double ahead =
        static_cast<double>(reading.sample.stamp.ns() - reading.quality.utc_ns) * 1e-9;
    if (utc_reported_ && std::abs(ahead - reported_ahead_s_) < kStep) return {};
    utc_reported_ = true;
    reported_ahead_s_ = ahead;
    return SourceEvent{EventRecord::make(reading.sample.stamp, "utc_offset",
                                         "the session's stamps are {:.4f} s {} the INS's UTC; they "
                                         "follow the host clock as set at the "
                                         "start",
                                         std::abs(ahead), ahead < 0 ? "behind" : "ahead of")};
  }

  SyncMode mode_;
  bool virtual_;
  bool ambiguous_ = false;  // the last set
  TimeHistogram latency_;
  InsQuality quality_{};  // as told last
  FixStatus fix_ = FixStatus::none;
  bool any_quality_ = false, utc_reported_ = false;
  double reported_ahead_s_ = 0;  // of the session's stamps ahead of the INS's UTC
};

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
        time_(devices_.sync().mode, request.fast),
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
    start_ = start_ + (devices_.start() - assumed);  // in real time the simulated rig sets it now
    if (devices_.mock() == nullptr) return;
    truth_ = true_trajectory(*devices_.mock(), configuration_, start_);
    if (!truth_.empty()) write_truth(faults);
  }

  [[nodiscard]] bool next(SourceItem* item) noexcept override {
    return items_.pop(item) || (acquire() && items_.pop(item));
  }

  void done(const PoseSample& sample) noexcept override {
    const auto* frame = std::get_if<AcquiredFrame>(&in_hand_);
    time_.record_pose(*frame, sample.estimate_ms, request_.fast ? HostStamp{} : monotonic_now());
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
          "streaming: "
          "set exposure.mode to fixed");
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
    input->time = time_.json(c, devices_);
    if (devices_.mock() != nullptr) input->truth = truth_metrics(totals, estimator);
  }

  [[nodiscard]] std::optional<ExitCode> verdict(Progress* progress) const override {
    if (acquisition_->missing().empty()) return std::nullopt;
    progress->print(
        fmt::format("vergence: camera {} was disconnected at the end; check its cable and power",
                    fmt::join(acquisition_->missing(), ", ")));
    return ExitCode::device_failed;
  }

 private:
  /// Real cameras do not end by themselves. A mock's do, after their last pulse, which a loaded
  /// machine brings late; but not where they are gone by then.
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

  /// Takes the next of the devices' data with the events around it. False: the drive is over.
  bool acquire() noexcept {
    if (!acquisition_->next(&in_hand_)) return false;
    if (const auto* frame = std::get_if<AcquiredFrame>(&in_hand_)) {
      if (const auto event = time_.of_set(*frame)) give(*event);
      give_faults(frame->rig.stamp);
      give(SourceFrame{frame->rig, 0});
    } else if (const auto* reading = std::get_if<InsRecord>(&in_hand_)) {
      give(*reading);
      if (const auto event = time_.of_reading(*reading)) give(*event);
    } else if (const auto* event = std::get_if<DeviceEvent>(&in_hand_)) {
      give(time_.of_device(*event));
    }
    return true;
  }

  /// There is room: the ring is empty before acquire(), and a frame brings at most kMaxFaults
  /// events of faults and one more.
  void give(const SourceItem& item) noexcept { (void)items_.push(item); }

  /// The simulated rig's faults that have begun by that frame; those beyond kMaxFaults come with
  /// the next one.
  void give_faults(Stamp stamp) noexcept {
    std::size_t given = 0;
    const auto faults = devices_.faults();
    for (std::size_t i = 0; i < faults.size() && given < kMaxFaults; ++i) {
      if (fault_logged_[i] || stamp < start_ + faults[i].at) continue;
      fault_logged_[i] = true;
      ++given;
      SourceEvent event{EventRecord::make(start_ + faults[i].at, "fault", "{}, as scheduled",
                                          mock::to_string(faults[i].kind))};
      event.recalibrate = faults[i].kind == mock::FaultKind::recalibrate;
      give(event);
    }
  }

  void write_truth(std::vector<std::string>* faults) const {
    try {
      LineFile file(request_.session.out / "truth.tum");
      constexpr std::size_t kTogether = 1000;  // lines: a tenth of what a file keeps waiting
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
        {"sets_complete", c.sync.complete},
        {"sets_incomplete", c.sync.incomplete},
        {"pulses_missed", c.sync.missed},
        {"sets_superseded", c.dropped_sets},
        {"readings_dropped", c.dropped_readings},
        {"frames_incomplete", c.torn},
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

  const RunRequest& request_;
  const Configuration& configuration_;
  DriveDevices devices_;
  std::unique_ptr<ExposureControl> exposure_;  // null: exposures are fixed
  PulseObserver* pulse_observer_ = nullptr;    // null: pulses are not recorded
  std::unique_ptr<Acquisition> acquisition_;
  Stamp start_{};  // of the drive
  std::chrono::steady_clock::time_point begun_{};
  std::vector<StampedPose> truth_;

  // Used by the estimator's thread; read by others after it has joined.
  TimingMonitor time_;
  std::vector<bool> fault_logged_;
  Acquired in_hand_{};
  Ring<SourceItem, 2 * kMaxFaults> items_;  // to be given, of in_hand_
};

}  // namespace

ExitCode run_drive(const RunRequest& request) {
  const SignalGuard signals;  // before a mock's world is built, which takes seconds
  try {
    const auto source = with_plain_errors([&] { return std::make_unique<LiveSource>(request); });
    if (const auto stopped = signals.stop_code()) return *stopped;  // devices are opened in seconds
    return run_session(*source, request.configuration, request.session, signals);
  } catch (const DeviceError&) {
    // After a stop by the user a missing device is no error.
    if (const auto stopped = signals.stop_code()) return *stopped;
    throw;
  }
}

}  // namespace vergence::app
