#pragma once

#include <mutex>

#include "tests/rigs/emulator.hpp"
#include "tests/support/device_terminal.hpp"
#include "tests/support/simulators/board_simulator.hpp"

namespace vergence::test {

/// The simulated trigger board at the far end of an emulated FTDI converter, in real time inside
/// the rig's kernel: the board's firmware state machine behind ftdi_sio.
///
/// Threads  pulses(): any. `told` is called on the board's own thread.
class BoardBehindConverter {
 public:
  static constexpr const char* kWire = "/run/vergence-board";

  /// `told`: of every pulse as it is made; returns what the cameras' exposure outputs do.
  explicit BoardBehindConverter(PulseSource reported = {})
      : converter_("sim_ftdi", {"--wire", kWire, "--serial", "VGBOARD1"}),
        reported_(std::move(reported)) {
    BoardSimulatorOptions options;
    options.power_on = monotonic_now();
    auto board = std::make_unique<BoardSimulator>(
        [this](const SimulatedPulse& pulse) { return take(pulse); }, options);
    board_ = std::make_unique<DeviceOnDescriptor>(::open(kWire, O_RDWR | O_NOCTTY | O_NONBLOCK),
                                                  std::move(board));
  }

  /// Every pulse that was made, with its true time.
  [[nodiscard]] std::vector<SimulatedPulse> pulses() const {
    const std::lock_guard lock(mutex_);
    return pulses_;
  }

 private:
  SimulatedExposures take(const SimulatedPulse& pulse) {
    {
      const std::lock_guard lock(mutex_);
      pulses_.push_back(pulse);
    }
    return reported_ ? reported_(pulse) : SimulatedExposures{};
  }

  Emulator converter_;
  PulseSource reported_;
  mutable std::mutex mutex_;
  std::vector<SimulatedPulse> pulses_;
  std::unique_ptr<DeviceOnDescriptor> board_;
};

}  // namespace vergence::test
