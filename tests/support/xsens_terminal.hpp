#pragma once
#include <memory>
#include <stdexcept>
#include <string>

#include "drivers/clock.hpp"
#include "drivers/mock/simulators/xsens_simulator.hpp"
#include "tests/support/device_terminal.hpp"

namespace vergence::test {

/// A reading of an INS that stands still in Brisbane, with a fix.
[[nodiscard]] inline InsSample resting_sample(std::uint64_t number, Duration /*time*/) {
  InsSample s;
  s.number = number;
  s.fix = FixStatus::fix_3d;
  s.attitude_valid = s.velocity_valid = true;
  s.position = {-27.4975, 153.0137, 60};
  return s;
}

/// A simulated XSens INS that rests so, from now on.
[[nodiscard]] inline std::unique_ptr<mock::XsensSimulator> resting_xsens(
    mock::XsensSimulatorOptions options = {}) {
  options.power_on = monotonic_now();
  return std::make_unique<mock::XsensSimulator>(resting_sample, options);
}

/// The same behind a pseudo-terminal: port() is what a driver opens.
class XsensOnTerminal {
 public:
  explicit XsensOnTerminal(const mock::XsensSimulatorOptions& options)
      : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0)
      throw std::runtime_error("no pseudo-terminal");
    port_ = ::ptsname(master_);
    sensor_ = std::make_unique<DeviceOnDescriptor>(master_, resting_xsens(options));
  }
  [[nodiscard]] const std::string& port() const noexcept { return port_; }

 private:
  int master_;
  std::string port_;
  std::unique_ptr<DeviceOnDescriptor> sensor_;
};

}  // namespace vergence::test
