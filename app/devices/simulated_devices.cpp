#include "app/devices/simulated_devices.hpp"

#include <algorithm>
#include <utility>

#include "app/devices/drive_sync.hpp"
#include "app/devices/serial_devices.hpp"
#include "app/runtime/errors.hpp"
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

}  // namespace vergence::app
