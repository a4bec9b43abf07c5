#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/mock/faults.hpp"
#include "drivers/trigger.hpp"

namespace vergence::mock {

/// When the mock's board pulses, over a whole drive: rate, varied intervals and its own restarts
/// are known beforehand; only a pause is asked for while it drives.
///
/// Threads  As any value; const after construction. Time: since the drive's start, by the host's
///          clock.
class PulsePlan {
 public:
  struct Slot {
    Duration time{};
    std::uint64_t number = 0;  // from 0 in every boot
    std::uint32_t boot = 0;    // counts from 0
  };
  /// The line between host and board goes or is there again.
  struct LinkEvent {
    Duration time{};
    bool gone = false;
  };

  PulsePlan() = default;
  /// The first pulse at 0, the last not after `length`.
  PulsePlan(const TriggerConfiguration& c, Duration length, const std::vector<Fault>& faults);

  [[nodiscard]] std::size_t size() const noexcept { return slots_.size(); }
  /// Beyond the last: evenly on.
  [[nodiscard]] Slot at(std::uint64_t i) const noexcept;
  /// The first slot not before that time.
  [[nodiscard]] std::size_t first_from(Duration time) const noexcept;
  [[nodiscard]] Duration period() const noexcept { return period_; }
  /// When that boot began.
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
