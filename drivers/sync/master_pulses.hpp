#pragma once
#include <cstdint>

#include "drivers/sync/sync_types.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// Derives pulses from the frames of a camera that triggers the others (SyncMode::master_strobe).
///
/// Numbers   Advance with its counter. After a restart, which resets the counter, they continue by
///           its clock. A counter that stands or runs back means another boot.
/// Gap       A pulse that is later than its counter implies by more than half an interval is the
///           first after a pause.
///
/// Not thread-safe. Does not allocate. Constant time per call.
class MasterPulses {
 public:
  struct Report {
    /// True if the newest frame was repeated; it makes no pulse and the other members are invalid.
    bool again = false;
    /// True if the counter ran back; the pulse then belongs to another boot.
    bool contradicted = false;
    /// Exposures without a frame, and so lost pulses, since the last frame.
    std::uint64_t lost = 0;
    /// Pulse with its time on the host's clock.
    Pulse pulse{};
  };

  /// `interval` is that of the pulses, > 0.
  explicit MasterPulses(Duration interval) noexcept : interval_(interval) {}

  [[nodiscard]] Report frame(const SyncFrame& frame) noexcept;
  /// Called after a restart: the counter changes, the clock may continue.
  void restart() noexcept { align_ = known_; }

 private:
  Duration interval_;
  // True after the first frame, which makes the members below valid.
  bool known_ = false;
  bool align_ = false;
  // Pulse number minus counter, modulo 2^64.
  std::uint64_t base_ = 0;
  std::uint64_t counter_ = 0;
  // Stamp of the newest frame.
  DeviceStamp stamp_{};
  std::uint32_t boot_ = 0;
};

}  // namespace vergence
