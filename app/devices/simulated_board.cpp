#include "app/devices/simulated_board.hpp"

#include <algorithm>
#include <utility>

#include "app/devices/drive_sync.hpp"
#include "app/devices/trigger_boards.hpp"
#include "app/runtime/errors.hpp"
#include "drivers/mock/simulators/board_simulator.hpp"
#include "drivers/mock/simulators/simulated_line.hpp"
#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::app {
namespace {

constexpr Duration kBefore =
    Duration::seconds(3);  // from power to the drive's start: finding and setting the board fit
constexpr Duration kAfter = Duration::seconds(
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

mock::BoardSimulatorOptions board_of(const Configuration& c, const mock::MockRig& rig) {
  mock::BoardSimulatorOptions o;
  o.clock_ppm = c.mock.clock_drift_ppm;
  o.power_on = rig.start() - kBefore;
  o.duration = kBefore + length_of(c, rig) + kAfter;
  o.pps = c.trigger.pps != trigger_board::Edge::none;
  o.seed = static_cast<std::uint64_t>(c.mock.seed);
  for (const mock::Fault& f : rig.truth().faults())
    if (f.kind == mock::FaultKind::board_reboot) o.reboots.push_back(rig.start() + f.at);
  std::sort(o.reboots.begin(), o.reboots.end());
  return o;
}

mock::SimulatedLineOptions line_of(const Configuration& c, const mock::MockRig& rig) {
  constexpr std::size_t kUsbPacket = 64;
  mock::SimulatedLineOptions o;
  o.start = rig.start() - kBefore;
  o.converter = c.mock.board_line == MockSettings::BoardLine::ftdi;
  if (o.converter)
    o.latency_timer = Duration::milliseconds(std::max(1, c.mock.board_latency_timer_ms));
  else
    o.fifo = kUsbPacket;
  o.late_fraction = o.sent_late_fraction = c.mock.board_late_percent / 100;
  o.late_mean = o.sent_late_mean = Duration::seconds(c.mock.board_late_ms * 1e-3);
  o.seed = static_cast<std::uint64_t>(c.mock.seed) + 1;
  for (const mock::Fault& f : rig.truth().faults()) {
    if (f.kind != mock::FaultKind::board_gone) continue;
    const HostStamp from = rig.start() + f.at,
                    never = rig.start() + length_of(c, rig) + Duration::seconds(1);
    o.outages.push_back({from, f.duration == Duration{} ? never : from + f.duration, f.powered});
  }
  std::sort(o.outages.begin(), o.outages.end(),
            [](const mock::Outage& a, const mock::Outage& b) { return a.from < b.from; });
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
      std::make_unique<mock::SimulatedPlace>(std::move(simulator), line_of(c, *rig)), options,
      &status, &error);
  if (board == nullptr) throw InputError("trigger: " + error);
  if (board->configure(trigger_configuration(c, rig->cameras()), nullptr) != DeviceStatus::ok)
    throw InputError(board_title(board->info()) + ": " + board->last_error());
  if (const std::string remark = board->remark(); !remark.empty())
    remarks->push_back(board_title(board->info()) + ": " + remark);
  *driver = board.get();
  return std::make_unique<SimulatedBoard>(rig, std::move(board));
}

}  // namespace vergence::app
