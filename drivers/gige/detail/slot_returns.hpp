#pragma once
#include <array>
#include <cstddef>
#include <mutex>

#include "drivers/common/frame_queue.hpp"

namespace vergence::gige {

/// The slots of a stream beside its FrameQueue: how many may be out, and those that come back to
/// the transport.
///
/// Ownership  A slot is the transport's, the queue's from offer() on, the consumer's, then on its
///            way back from release() on, and the transport's again by returned(). The queue
///            outlives it.
/// Threads    Each call by whom its comment names. One mutex, held for a few assignments only.
/// Memory     Fixed. Full: of more than `most` slots out the newest frame is refused and counted as
///            an underrun.
class SlotReturns {
 public:
  explicit SlotReturns(FrameQueue& queue) noexcept : queue_(queue) {}

  // The owner.
  /// At most so many slots are out. Precondition: stopped, no slot is held.
  void set_limit(std::size_t most) noexcept;
  /// Before the queue begins: what was offered and not taken, and what is on its way back, is the
  /// transport's. Precondition: nobody offers.
  void take_back() noexcept;

  // The releaser.
  void release(FrameSlot slot) noexcept;

  // The transport.
  /// False: refused, the slot stays the transport's.
  [[nodiscard]] bool offer(const Frame& frame) noexcept;
  /// The next slot that came back; false: none.
  [[nodiscard]] bool returned(FrameSlot* slot) noexcept;
  /// It is not the transport's.
  [[nodiscard]] bool is_out(FrameSlot slot) const noexcept;

 private:
  FrameQueue& queue_;
  mutable std::mutex mutex_;
  std::size_t most_ = 0;
  std::array<FrameSlot, FramePool::kMaxSlots> returned_{};
  std::size_t returned_count_ = 0;
};

}  // namespace vergence::gige
