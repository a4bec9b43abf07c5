#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "core/memory/arena.hpp"
#include "core/memory/frame_pool.hpp"
#include "core/types/image.hpp"
#include "drivers/camera.hpp"
#include "drivers/common/frame_queue.hpp"
#include "drivers/v4l2/capture_queue.hpp"

namespace vergence::v4l2 {

/// A camera's slots: the kernel's buffers where the pixels are grey as they come, else those of a
/// FramePool.
///
/// Survives a camera that comes back: buffers of the lost one that are still in use stay mapped
/// until they are released. Threads  One at a time; view() of a held slot at any time.
class Slots {
 public:
  static constexpr std::size_t kMax = FramePool::kMaxSlots;
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

  /// Requests new buffers from the kernel; earlier ones have no owner. Without effect on a pool's
  /// slots.
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
  std::array<Entry, kMax> entries_{};        // in place
  std::vector<std::uint16_t> buffer_slots_;  // entry of each buffer; kNone: there was no room
  std::vector<Mapping> raw_;                 // not in place
  std::unique_ptr<Arena> arena_;
  std::unique_ptr<FramePool> pool_;
  std::size_t held_ = 0;
};

inline constexpr std::size_t kBufferReserve =
    2;  // the kernel always has: with none it drops frames without counting them

/// Between the capture thread and the camera's users: frames one way, by a FrameQueue, and the
/// kernel's buffers back.
///
/// Threads  Each call by whom its comment names. One mutex beside the queue's, held for a few
///          assignments only, never across a system call.
/// Memory   Fixed, but for the slots (Slots). Full: the newest frame is refused and counted as an
///          underrun.
class FrameExchange {
 public:
  /// Buffers for the kernel.
  struct Buffers {
    std::array<std::uint32_t, Slots::kMax> index{};
    std::size_t count = 0;
    [[nodiscard]] std::span<const std::uint32_t> list() const noexcept {
      return std::span(index).first(count);
    }
  };

  // The owner.
  /// Streams, or images are in use.
  [[nodiscard]] bool busy() const noexcept;
  /// Grey in the kernel's buffers, as they come; or converted from them. Precondition: not busy.
  void use_buffers(int width, int height, std::size_t stride);
  void use_pool(int width, int height);
  /// Requests new buffers from the kernel; earlier ones have no owner.
  void install(std::vector<Mapping> mappings);
  /// Precondition: no capture thread runs. All that the kernel may have now.
  [[nodiscard]] Buffers free_buffers() noexcept;
  /// It streams: one start more. `silence` as FrameQueue::begin().
  void begin(Notifier* ready, Duration silence) noexcept;
  /// It does not, or not any more. Those who wait are woken.
  void end() noexcept { queue_.end(); }
  /// After the capture thread's end: buffers that were not consumed are free again. True: the node
  /// has died.
  [[nodiscard]] bool drain() noexcept;

  // Any thread.
  [[nodiscard]] bool started() const noexcept { return queue_.started(); }
  /// → ok (it streams), stopped, disconnected
  [[nodiscard]] DeviceStatus standing() const noexcept { return queue_.standing(); }
  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept { return slots_.view(slot); }
  [[nodiscard]] CameraStatistics statistics() const noexcept { return queue_.statistics(); }

  // The consumer.
  [[nodiscard]] DeviceStatus wait(Duration limit, Frame* frame) noexcept {
    return queue_.wait(limit, frame);
  }
  // The releaser.
  /// True: a buffer is free by it, for the capture thread.
  [[nodiscard]] bool release(FrameSlot slot) noexcept;

  // The capture thread.
  [[nodiscard]] Buffers pop_returned() noexcept;
  /// Constant while it streams, as are the buffers. Before it does, the owner's too.
  [[nodiscard]] const Slots& slots() const noexcept { return slots_; }
  [[nodiscard]] std::span<std::uint8_t> writable(FrameSlot slot) noexcept {
    return slots_.writable(slot);
  }
  void count_lost(std::uint64_t exposures) noexcept { queue_.count_lost(exposures); }
  /// The slot that a filled buffer is, its first pixel at `offset`; nothing: the kernel, which has
  /// `with_kernel` beside it, would have too few. Precondition: slots().in_place().
  [[nodiscard]] std::optional<FrameSlot> hold_buffer(std::uint32_t index, std::size_t offset,
                                                     std::size_t with_kernel) noexcept;
  /// A slot to convert into; nothing: all are out. Precondition: not slots().in_place().
  [[nodiscard]] std::optional<FrameSlot> hold_pooled() noexcept;
  /// Returns a held slot; it is freed if the stream was stopped meanwhile.
  void offer(const Frame& frame) noexcept;
  void record_dead_node() noexcept;
  /// From streaming: the camera is gone. Nothing happens where it was stopped.
  void lose(HostStamp when) noexcept { queue_.lose(when); }

 private:
  [[nodiscard]] std::optional<FrameSlot> counted(std::optional<FrameSlot> slot) noexcept;

  FrameQueue queue_;
  mutable std::mutex mutex_;  // of what follows
  Slots slots_;
  Buffers returned_{};
  bool node_died_ = false;
};

}  // namespace vergence::v4l2
