#pragma once
#include <array>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/memory/arena.hpp"
#include "core/memory/ring.hpp"
#include "core/types/image.hpp"

namespace vergence {

/// Handle of a slot of a FramePool, which is passed through rings.
using FrameSlot = std::uint16_t;

/// Image memory of one size, allocated once: slots start on a cache line, rows are padded to whole
/// cache lines.
///
///     Arena arena;
///     FramePool pool(752, 480, 4, arena);
///     if (const auto slot = pool.acquire()) {
///       fill(pool.writable(*slot), FramePool::stride(752));
///       use(pool.view(*slot));
///       pool.release(*slot);
///     }
///
/// Ownership  The caller owns a slot from acquire() to release(); views of it are valid for that
///            time.
/// Threads    acquire(), writable(): one thread. release(): one thread, the same or another.
///            view(): the holder of the slot.
/// Memory     From the arena in the constructor; no lock or system call afterwards.
/// Full       Without a free slot acquire() returns nothing, and the caller's policy applies
///            (replay waits, live drops and counts).
/// Errors     Releasing a slot that is not acquired has no effect.
class FramePool {
 public:
  /// 16 rig frames of four cameras; more only adds latency.
  static constexpr std::size_t kMaxSlots = 64;

  /// Number of bytes between the starts of two rows.
  [[nodiscard]] static constexpr std::size_t stride(int width) noexcept {
    return (static_cast<std::size_t>(width) + kCacheLine - 1) / kCacheLine * kCacheLine;
  }

  /// Preconditions: width, height > 0; 0 < slots ≤ kMaxSlots.
  FramePool(int width, int height, std::size_t slots, Arena& arena)
      : width_(width),
        height_(height),
        slots_(slots),
        bytes_(arena.make<std::uint8_t>(slots * stride(width) * static_cast<std::size_t>(height),
                                        "frame pool")) {
    assert(width > 0 && height > 0 && slots > 0 && slots <= kMaxSlots);
    for (std::size_t i = 0; i < slots; ++i) (void)free_.push(static_cast<FrameSlot>(i));
  }
  FramePool(const FramePool&) = delete;
  FramePool& operator=(const FramePool&) = delete;

  /// Returns a slot with undefined content, or nothing if all are acquired.
  [[nodiscard]] std::optional<FrameSlot> acquire() noexcept {
    FrameSlot slot = 0;
    if (!free_.pop(&slot)) return std::nullopt;
    out_[slot].store(true, std::memory_order_relaxed);
    return slot;
  }
  /// Returns false and changes nothing if the slot is not acquired. A slot released twice would be
  /// acquired twice, and one image would overwrite another.
  bool release(FrameSlot slot) noexcept {
    if (slot >= slots_ || !out_[slot].exchange(false, std::memory_order_relaxed)) return false;
    [[maybe_unused]] const bool room = free_.push(slot);
    assert(room);
    return true;
  }

  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept {
    assert(slot < slots_);
    return {bytes_.data() + slot * slot_bytes(), width_, height_,
            static_cast<std::ptrdiff_t>(stride(width_))};
  }
  /// All bytes of a slot, padding included; row y begins at y * stride(width()).
  [[nodiscard]] std::span<std::uint8_t> writable(FrameSlot slot) noexcept {
    assert(slot < slots_);
    return bytes_.subspan(slot * slot_bytes(), slot_bytes());
  }

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  [[nodiscard]] std::size_t slots() const noexcept { return slots_; }
  [[nodiscard]] std::size_t available() const noexcept { return free_.size(); }

 private:
  [[nodiscard]] std::size_t slot_bytes() const noexcept {
    return stride(width_) * static_cast<std::size_t>(height_);
  }

  int width_, height_;
  std::size_t slots_;
  std::span<std::uint8_t> bytes_;
  // The ring also orders the relaxed accesses to out_.
  Ring<FrameSlot, kMaxSlots> free_;
  std::array<std::atomic<bool>, kMaxSlots> out_{};
};

}  // namespace vergence
