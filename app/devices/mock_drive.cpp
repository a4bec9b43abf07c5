#include "app/devices/mock_drive.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "app/devices/drive_sync.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "drivers/mock/ins_model.hpp"
#include "drivers/mock/simulators/board_simulator.hpp"
#include "drivers/mock/simulators/simulated_line.hpp"
#include "drivers/mock/simulators/simulators.hpp"
#include "drivers/trigger_board/trigger_board.hpp"
#include "drivers/xsens/xsens.hpp"

namespace vergence::app {

namespace {

constexpr Duration kBoardBefore =
    Duration::seconds(3);  // from power to the drive's start: finding and setting the board fit
constexpr Duration kBoardAfter = Duration::seconds(
    8);  // a board that was away to the end is found and set once more, which ends the drive

/// The driver on its line, with the rig's cameras on the board's.
class SimulatedBoard final : public TriggerDevice {
 public:
  SimulatedBoard(mock::MockRig* rig, std::unique_ptr<trigger_board::Device> board)
      : rig_(rig), board_(std::move(board)) {}
  ~SimulatedBoard() override { stop(); }

  const DeviceInfo& info() const noexcept override { return board_->info(); }
  DeviceStatus configure(const TriggerConfiguration& c,
                         TriggerConfiguration* actual) noexcept override {
    return board_->configure(c, actual);
  }
  DeviceTiming timing() const noexcept override { return board_->timing(); }
  DeviceStatus start(Notifier* ready) noexcept override {
    if (!std::exchange(begun_, true)) {
      const DeviceStatus status = rig_->trigger().start(nullptr);
      if (status != DeviceStatus::ok) return status;
    }
    return over(board_->start(ready));
  }
  DeviceStatus wait(Duration limit, Pulse* pulse) noexcept override {
    return over(board_->wait(limit, pulse));
  }
  DeviceStatus pause(std::uint32_t pulses) noexcept override { return board_->pause(pulses); }
  void stop() noexcept override {
    board_->stop();
    rig_->end_feed();
    rig_->trigger().stop();
  }
  std::string last_error() const override { return board_->last_error(); }
  std::string remark() const override { return board_->remark(); }
  TriggerStatistics statistics() const noexcept override { return board_->statistics(); }

 private:
  DeviceStatus over(DeviceStatus status) noexcept {
    if (status == DeviceStatus::ended) rig_->end_feed();
    return status;
  }

  mock::MockRig* rig_;
  std::unique_ptr<trigger_board::Device> board_;
  bool begun_ = false;
};

Duration length_of(const Configuration& c, const mock::MockRig& rig) {
  return Duration::seconds(static_cast<double>(rig.pulses(c.trigger.rate)) / c.trigger.rate);
}

/// When a line is unplugged; one that never comes back is away for `after` beyond the drive's end.
std::vector<mock::Outage> outages_of(mock::FaultKind kind, const Configuration& c,
                                     const mock::MockRig& rig, Duration after) {
  std::vector<mock::Outage> outages;
  for (const mock::Fault& f : rig.truth().faults()) {
    if (f.kind != kind) continue;
    const HostStamp from = rig.start() + f.at, never = rig.start() + length_of(c, rig) + after;
    const bool powered = kind == mock::FaultKind::ins_gone || f.powered;
    outages.push_back({from, f.duration == Duration{} ? never : from + f.duration, powered});
  }
  std::sort(outages.begin(), outages.end(),
            [](const mock::Outage& a, const mock::Outage& b) { return a.from < b.from; });
  return outages;
}

mock::BoardSimulatorOptions board_of(const Configuration& c, const mock::MockRig& rig) {
  mock::BoardSimulatorOptions o;
  o.clock_ppm = c.mock.clock_drift_ppm;
  o.power_on = rig.start() - kBoardBefore;
  o.duration = kBoardBefore + length_of(c, rig) + kBoardAfter;
  o.pps = c.trigger.pps != trigger_board::Edge::none;
  o.seed = static_cast<std::uint64_t>(c.mock.seed);
  for (const mock::Fault& f : rig.truth().faults())
    if (f.kind == mock::FaultKind::board_reboot) o.reboots.push_back(rig.start() + f.at);
  std::sort(o.reboots.begin(), o.reboots.end());
  return o;
}

mock::SimulatedLineOptions board_line_of(const Configuration& c, const mock::MockRig& rig) {
  constexpr std::size_t kUsbPacket = 64;
  mock::SimulatedLineOptions o;
  o.start = rig.start() - kBoardBefore;
  o.converter = c.mock.board_line == MockSettings::BoardLine::ftdi;
  if (o.converter)
    o.latency_timer = Duration::milliseconds(std::max(1, c.mock.board_latency_timer_ms));
  else
    o.fifo = kUsbPacket;
  o.late_fraction = o.sent_late_fraction = c.mock.board_late_percent / 100;
  o.late_mean = o.sent_late_mean = Duration::seconds(c.mock.board_late_ms * 1e-3);
  o.seed = static_cast<std::uint64_t>(c.mock.seed) + 1;
  o.outages = outages_of(mock::FaultKind::board_gone, c, rig, Duration::seconds(1));
  return o;
}

/// The simulated board pulses on while its line is away and restarts with it: what one without a
/// supply would not do meanwhile.
bool is_off(const mock::MockRig& rig, HostStamp at) noexcept {
  const auto& faults = rig.truth().faults();
  return std::any_of(faults.begin(), faults.end(), [&](const mock::Fault& f) {
    return f.kind == mock::FaultKind::board_gone && !f.powered && f.active(at - rig.start());
  });
}

mock::PulseSource cameras_of(mock::MockRig* rig, HostStamp end) {
  return [rig, end](const mock::SimulatedPulse& pulse) {
    mock::SimulatedExposures out{};
    if (pulse.edge <= end && is_off(*rig, pulse.edge))
      return out;  // one after the end ends the drive
    const auto exposures = rig->feed(pulse.edge);
    for (std::size_t k = 0; k < std::min(out.size(), exposures.size()); ++k)
      if (exposures[k].seen)
        out[k] = {true, pulse.edge + exposures[k].start, pulse.edge + exposures[k].end};
    return out;
  };
}

constexpr Duration kInsBefore =
    Duration::seconds(5);  // from power to the drive's start: a baud scan and a reset fit
constexpr Duration kInsAfter =
    Duration::seconds(1);  // the last image's reading is on its way that long at most

mock::InsSource source_of(const Configuration& c, const mock::MockRig& rig) {
  mock::InsModelOptions o;
  o.ideal = c.mock.ins == MockSettings::Ins::ideal;
  o.seed = static_cast<std::uint64_t>(c.mock.seed);
  o.rate_hz = c.ins.rate;
  auto model = std::make_shared<mock::InsModel>(o, rig.truth());
  const Duration end = rig.truth().drive().duration();
  return [model = std::move(model), end](std::uint64_t number, Duration time) {
    return model->sample(number, std::clamp(time - kInsBefore, Duration{},
                                            end));  // before the start and after the end it stands
  };
}

mock::SimulatedLineOptions ins_line_of(const Configuration& c, const mock::MockRig& rig) {
  mock::SimulatedLineOptions o;
  o.start = rig.start() - kInsBefore;
  o.converter = c.mock.ins_latency_timer_ms > 0;
  o.latency_timer = Duration::milliseconds(c.mock.ins_latency_timer_ms);
  o.late_fraction = c.mock.ins_late_percent / 100;
  o.late_mean = Duration::seconds(c.mock.ins_late_ms * 1e-3);
  o.seed = static_cast<std::uint64_t>(c.mock.seed);
  o.outages = outages_of(mock::FaultKind::ins_gone, c, rig, Duration::seconds(3600));
  return o;
}

}  // namespace

std::unique_ptr<TriggerDevice> make_simulated_board(const Configuration& c, mock::MockRig* rig,
                                                    const trigger_board::Device** driver,
                                                    std::vector<std::string>* remarks) {
  auto simulator = std::make_shared<mock::BoardSimulator>(
      cameras_of(rig, rig->start() + length_of(c, *rig)), board_of(c, *rig));
  trigger_board::Options options = trigger_board_options(c.trigger);
  DeviceStatus status = DeviceStatus::ok;
  std::string error;
  auto board = trigger_board::open_on(
      std::make_unique<mock::SimulatedPlace>(std::move(simulator), board_line_of(c, *rig)), options,
      &status, &error);
  if (board == nullptr) throw InputError("trigger: " + error);
  if (board->configure(trigger_configuration(c, rig->cameras()), nullptr) != DeviceStatus::ok)
    throw InputError(board_title(board->info()) + ": " + board->last_error());
  if (const std::string remark = board->remark(); !remark.empty())
    remarks->push_back(board_title(board->info()) + ": " + remark);
  *driver = board.get();
  return std::make_unique<SimulatedBoard>(rig, std::move(board));
}

std::unique_ptr<InsDevice> make_simulated_ins(const Configuration& c, const mock::MockRig& rig,
                                              std::vector<std::string>* remarks) {
  mock::XsensSimulatorOptions sensor;
  sensor.generation = c.mock.ins_line == MockSettings::InsLine::mti_g ? xbus::Generation::legacy
                                                                      : xbus::Generation::mark4;
  sensor.device_id = sensor.generation == xbus::Generation::legacy ? 0x00500123 : 0x07701234;
  sensor.clock_ppm = c.mock.clock_drift_ppm;
  sensor.power_on = rig.start() - kInsBefore;
  sensor.duration = kInsBefore + length_of(c, rig) + kInsAfter;
  sensor.processing = Duration::seconds(c.ins.processing_ms * 1e-3);
  sensor.seed = static_cast<std::uint64_t>(c.mock.seed);
  auto simulator = std::make_shared<mock::XsensSimulator>(source_of(c, rig), sensor);
  xsens::Options options;
  options.baud = static_cast<std::uint32_t>(c.ins.baud);
  options.processing = sensor.processing;
  DeviceStatus status = DeviceStatus::ok;
  std::string error;
  auto device = xsens::open_on(
      std::make_unique<mock::SimulatedPlace>(std::move(simulator), ins_line_of(c, rig)), options,
      &status, &error);
  if (device == nullptr) throw InputError("ins: " + error);
  if (device->configure(c.ins.rate, nullptr) != DeviceStatus::ok)
    throw InputError(ins_title(device->info()) + ": " + device->last_error());
  if (const std::string remark = device->remark(); !remark.empty())
    remarks->push_back(ins_title(device->info()) + ": " + remark);
  return device;
}

namespace {

/// Checks a key that takes one of a few words where cameras are the mock's.
void one_of(const std::string& key, const std::string& value,
            const std::vector<std::string>& words) {
  for (const std::string& word : words)
    if (value == word) return;
  throw InputError(fmt::format("{} is \"{}\"{}; with mock cameras it takes {}", key, value,
                               did_you_mean(value, words), fmt::join(words, ", ")));
}

std::vector<mock::Fault> all_faults(const Configuration& c, const std::vector<std::string>& more) {
  std::vector<mock::Fault> faults;
  const auto add = [&](const std::string& text, const std::string& where) {
    try {
      faults.push_back(mock::parse_fault(text));
    } catch (const std::invalid_argument& e) {
      throw InputError(where + ": " + e.what());
    }
  };
  for (std::size_t i = 0; i < c.faults.size(); ++i)
    if (!c.faults[i].empty()) add(c.faults[i], fmt::format("faults.{}", i));
  for (const std::string& text : more) add(text, "--fault \"" + text.substr(0, 80) + "\"");
  return faults;
}

void configured(DeviceStatus status, const std::string& what) {
  if (status != DeviceStatus::ok)
    throw InputError(what + " is not possible: " + std::string(to_string(status)));
}

Duration trigger_delay(const Configuration& c, std::size_t k) {
  return Duration::nanoseconds(std::llround(c.cameras[k].trigger_delay_us * 1e3));
}

}  // namespace

void check_drive(const Configuration& c) {
  const int n = camera_count(c);
  if (n == 0)
    throw InputError(
        "the configuration names no camera; cameras: [{driver: mock}, {driver: mock}] is the "
        "least");
  if (n < 2)
    throw InputError(
        "one camera alone has no scale; two are the least, cameras: [{driver: mock}, {driver: "
        "mock}]");
  for (int k = 0; k < n; ++k) {
    const CameraSettings& camera = c.cameras[static_cast<std::size_t>(k)];
    one_of(fmt::format("cameras.{}.driver", k), camera.driver, {"mock"});
    if (camera.width != c.cameras[0].width || camera.height != c.cameras[0].height)
      throw InputError(
          fmt::format("cameras.{}.size is {} x {}, that of camera 0 is {} x {}; all cameras of a "
                      "rig have one size",
                      k, camera.width, camera.height, c.cameras[0].width, c.cameras[0].height));
  }
  one_of("ins.driver", c.ins.driver, {"mock", "none"});
  one_of("trigger.driver", c.trigger.driver, {"mock"});
  one_of("mock.world", c.mock.world, {"suburb"});
  (void)sync_options(c, n);
  (void)trigger_configuration(c, n);
}

MockDrive make_mock_drive(const Configuration& c, const std::vector<std::string>& more_faults,
                          bool real_time, std::optional<double> duration_s, bool raw) {
  MockDrive drive;
  const RigCalibration rig = mounted_rig(c);
  const std::vector<mock::Fault> faults = all_faults(c, more_faults);
  try {
    mock::WorldOptions world;
    world.seed = static_cast<std::uint64_t>(c.mock.seed);
    world.texture_detail = c.mock.texture_detail;
    world.hill_deg = c.mock.hill_deg;
    mock::DriveOptions way;
    way.kind = c.mock.drive;
    way.seed = world.seed;
    way.speed = c.mock.speed;
    way.suspension = c.mock.suspension;
    way.vibration = c.mock.vibration;
    way.stop_s = c.mock.stop_s;
    // The INS sits where the configuration says: p_ins = T_ins_left p_left.
    const Transform T_body_left = mock::default_T_body_left();
    const Transform T_body_ins = T_body_left * comparison_options(c).T_ins_left.inverse();
    auto truth = std::make_shared<const mock::RigTruth>(std::make_shared<const mock::World>(world),
                                                        way, rig, T_body_left, T_body_ins, faults);
    mock::MockRigOptions o;
    o.real_time = real_time;
    o.seed = world.seed;
    o.pattern = c.mock.pattern;
    o.raw = raw;
    o.noise = c.mock.noise != 0;
    o.blur_samples = c.mock.blur_samples;
    o.ideal_ins = c.mock.ins == MockSettings::Ins::ideal;
    o.clock_drift_ppm = c.mock.clock_drift_ppm;
    o.fed = c.mock.board_line != MockSettings::BoardLine::none;
    o.reports_taken =
        !o.fed &&
        c.sync.mode == SyncMode::board;  // else nobody asks for a pause, nor need take them
    for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
      o.trigger_delay[k] = trigger_delay(c, k);
    o.exposures_follow = exposes_by_itself(c);
    if (duration_s) o.duration = Duration::seconds(*duration_s);
    drive.rig = std::make_unique<mock::MockRig>(std::move(truth), o);
  } catch (const std::invalid_argument& e) {
    throw InputError(e.what());
  }
  for (int k = 0; k < rig.cameras; ++k) {
    const CameraSettings& camera = c.cameras[static_cast<std::size_t>(k)];
    const ExposureSetting start = starting_exposure(c, static_cast<std::size_t>(k));
    const CameraConfiguration requested{camera.width,   camera.height, c.trigger.rate,
                                        start.exposure, start.gain_db, CameraTrigger::hardware};
    configured(drive.rig->camera(k).configure(requested, nullptr), fmt::format("cameras.{}", k));
  }
  configured(drive.rig->trigger().configure(trigger_configuration(c, rig.cameras), nullptr),
             "trigger");
  drive.has_ins = c.ins.driver == "mock";
  if (drive.has_ins) configured(drive.rig->ins().configure(c.ins.rate, nullptr), "ins");
  return drive;
}

Duration stamp_grid(const Configuration& c) noexcept {
  return c.mock.pattern == mock::Pattern::gbrg ? Duration::microseconds(1)
                                               : Duration::nanoseconds(1);
}

std::vector<StampedPose> true_trajectory(const mock::MockRig& rig, const Configuration& c,
                                         Stamp start) {
  std::vector<StampedPose> poses;
  for (const Duration pulse : rig.pulse_times()) {
    const Duration middle =
        pulse + trigger_delay(c, 0) + Duration::seconds(c.cameras[0].exposure_us * 0.5e-6);
    poses.push_back({start + middle, rig.truth().camera_in_enu(0, middle)});
  }
  return poses;
}

}  // namespace vergence::app
