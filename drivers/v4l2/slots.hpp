#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/memory/arena.hpp"
#include "core/memory/frame_pool.hpp"
#include "core/types/image.hpp"
#include "drivers/v4l2/capture_queue.hpp"

namespace vergence::v4l2 {

/// A camera's slots: the kernel's buffers where the pixels are grey as they come, else those of a
/// FramePool.
///
/// Survives a camera that comes back: buffers of the lost one that somebody holds stay mapped until
/// they are released.
/// Threads  One at a time; view() of a held slot at any time.
class Slots {
 public:
  static constexpr std::size_t kMost = FramePool::kMaxSlots;
  static constexpr std::size_t kPool =
      16;  // as many as buffers by default: the synchroniser's, the estimator's, the next

  /// Grey as they come: slots are buffers. Precondition: nothing is held.
  void use_buffers(int width, int height, std::size_t stride);
  /// To be turned to grey: slots are the pool's. Precondition as above. May throw std::bad_alloc.
  void use_pool(int width, int height);
  [[nodiscard]] bool in_place() const noexcept { return pool_ == nullptr; }
  /// Images that come grey with such rows, or that are to be turned to grey, fit the slots that are
  /// there: those held can stay.
  [[nodiscard]] bool fit(bool grey_as_they_come, std::size_t stride) const noexcept {
    return grey_as_they_come == in_place() && (!grey_as_they_come || stride == stride_);
  }

  /// New buffers from the kernel, those before become nobody's. Without effect on a pool's slots.
  void install(std::vector<Mapping> mappings);
  [[nodiscard]] std::span<const std::uint8_t> buffer(std::uint32_t index) const noexcept;
  [[nodiscard]] std::size_t buffers() const noexcept { return buffer_slots_.size(); }
  /// In place: buffers that are neither the kernel's nor held may go to the kernel. A pool's:
  /// always.
  [[nodiscard]] bool may_enqueue(std::uint32_t index) const noexcept;

  /// The slot that a filled buffer is, now held; its first pixel lies at `offset`.
  [[nodiscard]] FrameSlot hold_buffer(std::uint32_t index, std::size_t offset = 0) noexcept;
  [[nodiscard]] std::optional<FrameSlot> hold_pooled() noexcept;
  [[nodiscard]] std::span<std::uint8_t> writable(FrameSlot slot) noexcept {
    return pool_->writable(slot);
  }
  /// → the buffer that is free by it; nothing for a pool's slot, or a buffer of a camera that was
  ///   lost.
  std::optional<std::uint32_t> release(FrameSlot slot) noexcept;
  [[nodiscard]] std::size_t held() const noexcept { return held_; }

  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept;

 private:
  struct Entry {
    Mapping memory{};
    bool used = false, held = false;
    bool current = false;  // of the newest buffers
    std::uint32_t buffer = 0;
    std::size_t offset = 0;
  };
  int width_ = 0, height_ = 0;
  std::size_t stride_ = 0;
  std::array<Entry, kMost> entries_{};       // in place
  std::vector<std::uint16_t> buffer_slots_;  // entry of each buffer; kNone: there was no room
  std::vector<Mapping> raw_;                 // not in place
  std::unique_ptr<Arena> arena_;
  std::unique_ptr<FramePool> pool_;
  std::size_t held_ = 0;
};

}  // namespace vergence::v4l2
