#pragma once
#include <cmath>

#include "drivers/xsens/device.hpp"
#include "tests/unit/drivers/conformance/serial_conformance.hpp"

namespace vergence::test {

/// A drive that is easy to recompute: the sensor turns and moves along known functions of time.
[[nodiscard]] inline InsSample easy_drive(std::uint64_t number, Duration time) {
  const double t = time.to_seconds();
  InsSample s{.number = number,
              .fix = FixStatus::fix_3d,
              .attitude_valid = true,
              .velocity_valid = true,
              .position = {-27.4975 + 1e-5 * t, 153.0137 + 2e-5 * t, 60 + 0.1 * t},
              .velocity_enu = {2.0 + 0.01 * t, 1.1, -0.1}};
  const double yaw = 0.3 + 0.02 * t, roll = 0.05, h = 0.5;
  // yaw about up, then roll about forward
  s.q_enu_ins = {std::cos(h * yaw) * std::sin(h * roll), std::sin(h * yaw) * std::sin(h * roll),
                 std::sin(h * yaw) * std::cos(h * roll), std::cos(h * yaw) * std::cos(h * roll)};
  s.position_sigma = 1.5, s.height_sigma = 3, s.velocity_sigma = 0.1;
  return s;
}

/// The simulator of a generation with what goes with it.
[[nodiscard]] inline XsensSimulatorOptions simulated(xbus::Generation generation,
                                                     double seconds = 0) {
  XsensSimulatorOptions o;
  if (seconds > 0) o.duration = Duration::seconds(seconds);
  o.generation = generation;
  o.device_id = generation == xbus::Generation::legacy ? 0x00500123 : 0x07701234;
  return o;
}

/// A driver's device on a simulated line.
struct XsensRig {
  explicit XsensRig(const XsensSimulatorOptions& sensor = {}, const SimulatedLineOptions& line = {},
                    const xsens::Options& options = {}, InsSource source = easy_drive,
                    Tampered::Tamper tamper = {})
      : simulator(std::make_shared<XsensSimulator>(std::move(source), sensor)),
        between(std::make_shared<Tampered>(simulator, std::move(tamper))),
        device(std::make_unique<xsens::Device>(
            std::make_unique<SimulatedLinkFactory>(between, line), options)) {}

  std::shared_ptr<XsensSimulator> simulator;
  std::shared_ptr<Tampered> between;
  std::unique_ptr<xsens::Device> device;

  void start(double rate_hz = 100) {
    ASSERT_EQ(device->configure(rate_hz, nullptr), DeviceStatus::ok) << device->last_error();
    ASSERT_EQ(device->start(nullptr), DeviceStatus::ok);
  }
  /// All readings until the device has no more, or this many; `disconnected` is passed over.
  std::vector<InsReading> readings(std::size_t most = SIZE_MAX) {
    return all_of<InsReading>(*device, most, &disconnects);
  }
  /// All readings of the sensor's time.
  std::vector<InsReading> drive(double rate_hz = 100) {
    start(rate_hz);
    return readings();
  }
  int disconnects = 0;
};

}  // namespace vergence::test
