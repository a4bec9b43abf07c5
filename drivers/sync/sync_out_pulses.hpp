#pragma once
#include <cstdint>
#include <optional>

#include "drivers/ins.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// The pulses of an INS's SyncOut, from its readings: for the mode ins_syncout.
///
/// Numbers  Intervals of the INS's own clock, which makes the pulses too; a reading that was lost
///          loses no number. A gap made on purpose must be told by restart(): numbers go on after
///          it, for it is the gap between pulses of one boot that proves. So the clock must go on
///          over the gap, and every pulse on either side of it have its reading.
/// Marks    InsQuality::sync_out, on the sample after the pulse: edges are multiples of the
///          interval, 400 Hz / n, from the earliest mark.
/// Not thread-safe. Does not allocate. Errors: none; a clock that runs back is another boot.
class SyncOutPulses {
 public:
  /// `interval`: between two pulses, as good as a decimal rate says it.
  explicit SyncOutPulses(Duration interval) noexcept;

  /// The pulse that left with this reading, if one did. `at`: the reading's stamp on the host's
  /// clock.
  [[nodiscard]] std::optional<Pulse> reading(const InsReading& reading, MappedStamp at) noexcept;
  /// The device was told to stop measuring and to go on: a gap.
  void restart() noexcept { fresh_ = true; }

 private:
  Duration interval_;
  bool any_ = false, fresh_ = true;
  DeviceStamp first_{};  // pulse that the next are reckoned from, numbered base_
  DeviceStamp last_{};   // reading that was looked at
  std::uint64_t base_ = 0, number_ = 0;
  std::uint32_t boot_ = 0;
};

}  // namespace vergence
