#pragma once
#include <cstdint>
#include <optional>

#include "drivers/ins.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// The pulses of an INS's SyncOut, from its readings: for the mode ins_syncout.
///
/// Numbers  Marked readings (InsQuality::sync_out) are pulses. Where the device marks none, every `divider`-th reading since restart() is
///          one, readings counted by their own clock, so that a lost one is counted too. Pulses whose readings were lost are left out of
///          the numbers; a gap made on purpose must be told by restart().
/// Threads  One caller. Memory: in place. Errors: none; a clock that runs back is another boot.
class SyncOutPulses {
 public:
  /// `interval`: between two pulses. `divider`: readings a pulse where none are marked; 0: they are marked.
  SyncOutPulses(Duration interval, std::uint32_t divider) noexcept : interval_(interval), divider_(divider) {}

  /// The pulse that left with this reading, if one did. `at`: the reading's stamp on the host's clock.
  [[nodiscard]] std::optional<Pulse> reading(const InsReading& reading, MappedStamp at) noexcept;
  /// The device was told to stop measuring and to go on: a gap. Its first reading after it is a pulse.
  void restart() noexcept { fresh_ = true; }

 private:
  [[nodiscard]] bool pulsed(const InsReading& reading) noexcept;

  Duration interval_;
  std::uint32_t divider_;
  bool any_ = false, fresh_ = true;
  DeviceStamp first_{};  // reading since the gap
  DeviceStamp last_{};   // pulse
  std::uint64_t number_ = 0;
  std::uint32_t boot_ = 0;
};

}  // namespace vergence
