#pragma once
#include <atomic>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>

#include "core/memory/frame_pool.hpp"

namespace vergence::iidc {

/// Lock-free set of slot numbers, in one word. Thread-safe.
class SlotSet {
 public:
  /// Fills the set with the first n numbers; n ≤ 64.
  void fill(std::size_t n) noexcept {
    bits_.store(n >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1,
                std::memory_order_release);
  }
  void clear() noexcept { bits_.store(0, std::memory_order_release); }
  void put(FrameSlot slot) noexcept {
    bits_.fetch_or(std::uint64_t{1} << slot, std::memory_order_acq_rel);
  }
  /// Removes the slot; returns false if it was not in the set.
  bool remove(FrameSlot slot) noexcept {
    const std::uint64_t one = std::uint64_t{1} << slot;
    return (bits_.fetch_and(~one, std::memory_order_acq_rel) & one) != 0;
  }
  /// Removes the lowest slot.
  [[nodiscard]] std::optional<FrameSlot> pop() noexcept {
    std::uint64_t bits = bits_.load(std::memory_order_acquire);
    while (bits != 0)
      if (bits_.compare_exchange_weak(bits, bits & (bits - 1), std::memory_order_acq_rel))
        return static_cast<FrameSlot>(std::countr_zero(bits));
    return std::nullopt;
  }
  [[nodiscard]] std::uint64_t pop_all() noexcept {
    return bits_.exchange(0, std::memory_order_acq_rel);
  }
  [[nodiscard]] std::uint64_t bits() const noexcept {
    return bits_.load(std::memory_order_acquire);
  }
  [[nodiscard]] std::size_t size() const noexcept {
    return static_cast<std::size_t>(std::popcount(bits()));
  }

 private:
  std::atomic<std::uint64_t> bits_{0};
};

/// Page-aligned buffers of one size that serve as slots.
///
/// acquire() gives a slot to the caller until release(); both, and bytes(), are thread-safe. Only
/// allocate() allocates; the other calls use neither lock nor system call.
class SlotMemory {
 public:
  /// Throws std::bad_alloc. Precondition: 0 < slots ≤ FramePool::kMaxSlots; none is out.
  void allocate(std::size_t slots, std::size_t bytes) {
    assert(slots > 0 && slots <= FramePool::kMaxSlots && bytes > 0);
    // Whole pages, with room for a vector load that begins inside an image.
    const std::size_t each = (bytes + kCacheLine + kPage - 1) / kPage * kPage;
    memory_.reset(static_cast<std::byte*>(::operator new (slots* each, std::align_val_t{kPage})));
    each_ = each;
    free_.fill(slots);
  }
  [[nodiscard]] std::optional<FrameSlot> acquire() noexcept { return free_.pop(); }
  void release(FrameSlot slot) noexcept { free_.put(slot); }
  [[nodiscard]] std::uint8_t* bytes(FrameSlot slot) const noexcept {
    return reinterpret_cast<std::uint8_t*>(memory_.get()) + slot * each_;
  }

 private:
  static constexpr std::size_t kPage = 4096;
  struct Free {
    void operator()(std::byte* p) const noexcept { ::operator delete (p, std::align_val_t{kPage}); }
  };
  std::unique_ptr<std::byte[], Free> memory_;
  std::size_t each_ = 0;
  SlotSet free_;
};

}  // namespace vergence::iidc
