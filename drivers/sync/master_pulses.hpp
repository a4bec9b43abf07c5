#pragma once
#include <cstdint>

#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// The pulses of a camera that triggers the others, from its frames: for the mode master_strobe.
///
/// Numbers   Advance as its counter does. Over a restart, where the counter is another, they go on
///           by its clock; a counter that stands or runs back is another boot.
/// Gap       A pulse that came more than half an interval later than its counter says is the first
///           after a pause.
/// Not thread-safe. Does not allocate. Constant time per call.
/// Errors    None: told in the report.
class MasterPulses {
 public:
  struct Report {
    bool again = false;  // the newest frame once more: it makes no pulse, the rest means nothing
    bool contradicted = false;  // the counter ran back: the pulse is of another boot
    std::uint64_t lost = 0;     // exposures, and so pulses, without a frame since the last one
    Pulse pulse{};              // mapped
  };

  /// `interval`: between two pulses, > 0.
  explicit MasterPulses(Duration interval) noexcept : interval_(interval) {}

  [[nodiscard]] Report frame(const SyncFrame& frame) noexcept;
  /// It was started again: its count is another, its clock may go on.
  void restart() noexcept { align_ = known_; }

 private:
  Duration interval_;
  bool known_ = false;  // a frame has come: what is below means something
  bool align_ = false;
  std::uint64_t base_ = 0;  // pulse number − counter, modulo 2^64
  std::uint64_t counter_ = 0;
  DeviceStamp stamp_{};  // the newest frame's
  std::uint32_t boot_ = 0;
};

}  // namespace vergence
