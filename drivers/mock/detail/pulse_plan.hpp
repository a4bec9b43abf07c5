#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/mock/faults.hpp"
#include "drivers/trigger.hpp"

namespace vergence::mock {

/// Pulse times of the simulated trigger board over a whole drive. Rate, dither and restarts are
/// known beforehand; only pauses are requested during the drive. Times are on the host's clock
/// since the start of the drive. Constant after construction.
class PulsePlan {
 public:
  struct Slot {
    Duration time{};
    /// Number within the boot, from 0.
    std::uint64_t number = 0;
    /// Index of the boot, from 0.
    std::uint32_t boot = 0;
  };
  /// The link between host and trigger board fails or returns.
  struct LinkEvent {
    Duration time{};
    bool disconnected = false;
  };

  PulsePlan() = default;
  /// The first pulse is at 0, the last not after `length`.
  PulsePlan(const TriggerConfiguration& c, Duration length, const std::vector<Fault>& faults);

  [[nodiscard]] std::size_t size() const noexcept { return slots_.size(); }
  /// Slot i; beyond the last one at even intervals.
  [[nodiscard]] Slot at(std::uint64_t i) const noexcept;
  /// First slot not before that time.
  [[nodiscard]] std::size_t first_from(Duration time) const noexcept;
  [[nodiscard]] Duration period() const noexcept { return period_; }
  /// Start of that boot.
  [[nodiscard]] Duration boot_time(std::uint32_t boot) const noexcept { return boots_[boot]; }
  [[nodiscard]] const std::vector<LinkEvent>& link() const noexcept { return link_; }
  [[nodiscard]] bool link_down(Duration time) const noexcept;

 private:
  Duration period_{};
  std::vector<Slot> slots_;
  std::vector<Duration> boots_;
  std::vector<LinkEvent> link_;
};

}  // namespace vergence::mock
