#include "app/devices/simulated_ins.hpp"

#include <algorithm>
#include <utility>

#include "app/devices/ins_drivers.hpp"
#include "app/runtime/errors.hpp"
#include "drivers/mock/ins_model.hpp"
#include "drivers/mock/simulators/simulators.hpp"
#include "drivers/xsens/xsens.hpp"

namespace vergence::app {
namespace {

constexpr Duration kBefore =
    Duration::seconds(5);  // from power to the drive's start: a baud scan and a reset fit
constexpr Duration kAfter =
    Duration::seconds(1);  // the last image's reading is on its way that long at most

Duration length_of(const Configuration& c, const mock::MockRig& rig) {
  return Duration::seconds(static_cast<double>(rig.pulses(c.trigger.rate)) / c.trigger.rate);
}

mock::InsSource source_of(const Configuration& c, const mock::MockRig& rig) {
  mock::InsModelOptions o;
  o.ideal = c.mock.ins == MockSettings::Ins::ideal;
  o.seed = static_cast<std::uint64_t>(c.mock.seed);
  o.rate_hz = c.ins.rate;
  auto model = std::make_shared<mock::InsModel>(o, rig.truth());
  const Duration end = rig.truth().drive().duration();
  return [model = std::move(model), end](std::uint64_t number, Duration time) {
    return model->sample(number, std::clamp(time - kBefore, Duration{},
                                            end));  // before the start and after the end it stands
  };
}

mock::SimulatedLineOptions line_of(const Configuration& c, const mock::MockRig& rig) {
  mock::SimulatedLineOptions o;
  o.start = rig.start() - kBefore;
  o.converter = c.mock.ins_latency_timer_ms > 0;
  o.latency_timer = Duration::milliseconds(c.mock.ins_latency_timer_ms);
  o.late_fraction = c.mock.ins_late_percent / 100;
  o.late_mean = Duration::seconds(c.mock.ins_late_ms * 1e-3);
  o.seed = static_cast<std::uint64_t>(c.mock.seed);
  for (const mock::Fault& f : rig.truth().faults()) {
    if (f.kind != mock::FaultKind::ins_gone) continue;
    const HostStamp from = rig.start() + f.at,
                    never = rig.start() + length_of(c, rig) + Duration::seconds(3600);
    o.outages.push_back({from, f.duration == Duration{} ? never : from + f.duration, true});
  }
  std::sort(o.outages.begin(), o.outages.end(),
            [](const mock::Outage& a, const mock::Outage& b) { return a.from < b.from; });
  return o;
}

}  // namespace

std::unique_ptr<InsDevice> make_simulated_ins(const Configuration& c, const mock::MockRig& rig,
                                              std::vector<std::string>* remarks) {
  mock::XsensSimulatorOptions sensor;
  sensor.generation = c.mock.ins_line == MockSettings::InsLine::mti_g ? xbus::Generation::legacy
                                                                      : xbus::Generation::mark4;
  sensor.device_id = sensor.generation == xbus::Generation::legacy ? 0x00500123 : 0x07701234;
  sensor.clock_ppm = c.mock.clock_drift_ppm;
  sensor.power_on = rig.start() - kBefore;
  sensor.duration = kBefore + length_of(c, rig) + kAfter;
  sensor.processing = Duration::seconds(c.ins.processing_ms * 1e-3);
  sensor.seed = static_cast<std::uint64_t>(c.mock.seed);
  auto simulator = std::make_shared<mock::XsensSimulator>(source_of(c, rig), sensor);
  xsens::Options options;
  options.baud = static_cast<std::uint32_t>(c.ins.baud);
  options.processing = sensor.processing;
  DeviceStatus status = DeviceStatus::ok;
  std::string error;
  auto device =
      xsens::open_on(std::make_unique<mock::SimulatedPlace>(std::move(simulator), line_of(c, rig)),
                     options, &status, &error);
  if (device == nullptr) throw InputError("ins: " + error);
  if (device->configure(c.ins.rate, nullptr) != DeviceStatus::ok)
    throw InputError(ins_title(device->info()) + ": " + device->last_error());
  if (const std::string remark = device->remark(); !remark.empty())
    remarks->push_back(ins_title(device->info()) + ": " + remark);
  return device;
}

}  // namespace vergence::app
