#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/sync/pulse_train.hpp"

namespace vergence {

/// Whether triggers were missed or the camera's clock was set by as much: both look alike at first.
///
/// Method   Had the clock been set instead of s triggers missed, the stamps would now follow the
///          pulse s earlier, a constant time off. That is refuted once this time has changed by
///          more than the limit given. Intervals that differ settle it soon, even ones not before a
///          pause.
/// Threads  One caller. Memory: fixed. Time: at most kMost steps a call.
///
///     if (!doubt.add(missed)) return;  // more than can be followed
///     if (doubt.any() && doubt.compare(train, number, gate * 2)) return;  // settled
class MissedTriggerDoubt {
 public:
  static constexpr std::size_t kMost = 8;  // pulses missed since the doubt began

  void clear() noexcept { pulses_ = 0; }
  [[nodiscard]] bool any() const noexcept { return pulses_ > 0; }
  /// So many more triggers seem to have been missed. False: more than kMost.
  [[nodiscard]] bool add(std::uint64_t missed) noexcept;
  /// A frame of this reported pulse fits it. True: the triggers were missed, the doubt is over.
  [[nodiscard]] bool compare(const PulseTrain& train, std::uint64_t number,
                             Duration limit) noexcept;

 private:
  /// The pulse s before the frame's.
  struct Rival {
    Duration least{}, greatest{};  // time to it, seen in doubt
    bool compared = false, refuted = false;
  };

  std::uint64_t pulses_ = 0;  // by which the frames may be off; 0: none
  std::array<Rival, kMost> rivals_{};
};

}  // namespace vergence
