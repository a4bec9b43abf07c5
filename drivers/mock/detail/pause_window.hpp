#pragma once
#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>

namespace vergence::mock {

/// The slots of a pulse plan that a pause leaves out.
///
/// Threads  request(): any. make(): the scheduler's producer, slot after slot. Memory: none.
class PauseWindow {
 public:
  /// So many slots from that one on, in this boot (0: in any); slots that were made already stay.
  void request(std::uint64_t from, std::uint32_t pulses, std::uint32_t boot) noexcept {
    const std::lock_guard lock(mutex_);
    from = std::max(from, made_);
    pause_ = {from, from + pulses, boot};
  }
  /// Slot `slot` is made now, in this boot. True: it is left out.
  [[nodiscard]] bool make(std::uint64_t slot, std::uint32_t boot) noexcept {
    const std::lock_guard lock(mutex_);
    made_ = slot + 1;
    if (!pause_) return false;
    const bool in_boot = pause_->boot == 0 || pause_->boot == boot;
    if (!in_boot || slot >= pause_->end) pause_.reset();
    return pause_ && slot >= pause_->from;
  }

 private:
  struct Pause {
    std::uint64_t from = 0, end = 0;  // slots
    std::uint32_t boot = 0;           // of Pulse
  };
  std::mutex mutex_;
  std::optional<Pause> pause_;
  std::uint64_t made_ = 0;  // slots
};

}  // namespace vergence::mock
