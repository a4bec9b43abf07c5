#pragma once

#include "tests/support/device_terminal.hpp"
#include "tests/support/simulators/xsens_simulator.hpp"

namespace vergence::test {

/// A reading of an INS that stands still in Brisbane, with a fix.
[[nodiscard]] inline InsSample resting_sample(std::uint64_t number, Duration /*time*/) {
  return {.number = number,
          .fix = FixStatus::fix_3d,
          .attitude_valid = true,
          .velocity_valid = true,
          .position = {-27.4975, 153.0137, 60}};
}

/// A simulated XSens INS that rests so, from now on.
[[nodiscard]] inline std::unique_ptr<XsensSimulator> resting_xsens(
    XsensSimulatorOptions options = {}) {
  options.power_on = monotonic_now();
  return std::make_unique<XsensSimulator>(resting_sample, options);
}

}  // namespace vergence::test
