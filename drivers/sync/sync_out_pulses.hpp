#pragma once
#include <cstdint>
#include <optional>

#include "drivers/ins.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// Derives the pulses of an INS's SyncOut from its samples (SyncMode::ins_syncout).
///
/// Numbers  Count intervals of the INS's own clock, which makes the pulses too, so a lost sample
///          loses no number. Call restart() at an intended gap: numbers continue across it, because
///          the gap between pulses of one boot verifies the pairing. The clock must therefore
///          continue across the gap, and every pulse next to it needs its sample.
/// Marks    InsQuality::sync_out is set on the sample after the pulse: edges are multiples of the
///          interval, 400 Hz / n, from the earliest mark.
///
/// Not thread-safe. Does not allocate. A clock that runs back means another boot.
class SyncOutPulses {
 public:
  /// `interval` is that of the pulses, as exact as its decimal rate.
  explicit SyncOutPulses(Duration interval) noexcept;

  /// Returns the pulse that was sent with this sample, if any. `at` is the sample's stamp on the
  /// host's clock.
  [[nodiscard]] std::optional<Pulse> reading(const InsReading& reading, MappedStamp at) noexcept;
  /// Called after the device was stopped and started again: a gap.
  void restart() noexcept { fresh_ = true; }

 private:
  Duration interval_;
  bool any_ = false, fresh_ = true;
  // Pulse from which the next are computed; its number is base_.
  DeviceStamp first_{};
  // Newest sample.
  DeviceStamp last_{};
  std::uint64_t base_ = 0, number_ = 0;
  std::uint32_t boot_ = 0;
};

}  // namespace vergence
