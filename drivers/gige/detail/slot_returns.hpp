#pragma once
#include <array>
#include <cstddef>
#include <mutex>

#include "drivers/common/frame_queue.hpp"

namespace vergence::gige {

/// Limits how many slots of a stream may be out, and collects released slots for the transport.
///
/// Ownership  A slot goes from the transport to the queue (offer()), to the consumer, and after
///            release() and returned() back to the transport. The queue outlives this object.
/// Threads    The comment above each group of calls names the thread. One mutex is held for a few
///            assignments.
/// Memory     Fixed. If `most` slots are out, the newest frame is refused and counted as an
///            underrun.
class SlotReturns {
 public:
  explicit SlotReturns(FrameQueue& queue) noexcept : queue_(queue) {}

  // Calls of the owner.

  /// Sets the maximum number of slots that are out. Precondition: stopped, no slot is held.
  void set_limit(std::size_t most) noexcept;
  /// Called before the queue begins: takes back the frames that were offered and not handed out,
  /// and the released slots. Precondition: no thread offers.
  void withdraw() noexcept;

  // Call of the releaser.
  void release(FrameSlot slot) noexcept;

  // Calls of the transport.

  /// Returns false if refused; the slot then stays with the transport.
  [[nodiscard]] bool offer(const Frame& frame) noexcept;
  /// Takes the next released slot; returns false if there is none.
  [[nodiscard]] bool returned(FrameSlot* slot) noexcept;
  /// True if the slot does not belong to the transport.
  [[nodiscard]] bool is_out(FrameSlot slot) const noexcept;

 private:
  FrameQueue& queue_;
  mutable std::mutex mutex_;
  std::size_t most_ = 0;
  std::array<FrameSlot, FramePool::kMaxSlots> returned_{};
  std::size_t returned_count_ = 0;
};

}  // namespace vergence::gige
