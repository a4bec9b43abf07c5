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

/// Slots of a camera: the kernel's buffers if their pixels are grey, otherwise those of a
/// FramePool.
///
/// Survives a reconnect: buffers of the lost camera that are still in use stay mapped until they
/// are released. Not thread-safe, except view() of a held slot.
class Slots {
 public:
  static constexpr std::size_t kMax = FramePool::kMaxSlots;
  /// Same as the default number of buffers; serves the synchroniser, the estimator and the next
  /// frame.
  static constexpr std::size_t kPool = 16;

  /// Makes the kernel's buffers the slots, for pixels that are grey. Precondition: no slot is held.
  void use_buffers(int width, int height, std::size_t stride);
  /// Makes a FramePool's slots the slots, for pixels that are converted. Same precondition. May
  /// throw std::bad_alloc.
  void use_pool(int width, int height);
  [[nodiscard]] bool in_place() const noexcept { return pool_ == nullptr; }
  /// True if images of this kind fit the present slots, so that held ones can stay.
  [[nodiscard]] bool fit(bool grey_as_they_come, std::size_t stride) const noexcept {
    return grey_as_they_come == in_place() && (!grey_as_they_come || stride == stride_);
  }

  /// Installs new buffers of the kernel; earlier ones have no owner. Does not affect the slots of a
  /// pool.
  void install(std::vector<Mapping> mappings);
  [[nodiscard]] std::span<const std::uint8_t> buffer(std::uint32_t index) const noexcept;
  [[nodiscard]] std::size_t buffers() const noexcept { return buffer_slots_.size(); }
  /// True if the kernel may have the buffer: always for a pool, otherwise if it is neither queued
  /// nor held.
  [[nodiscard]] bool may_enqueue(std::uint32_t index) const noexcept;

  /// Marks the slot of a filled buffer as held; its first pixel is at `offset`.
  [[nodiscard]] FrameSlot hold_buffer(std::uint32_t index, std::size_t offset = 0) noexcept;
  [[nodiscard]] std::optional<FrameSlot> hold_pooled() noexcept;
  [[nodiscard]] std::span<std::uint8_t> writable(FrameSlot slot) noexcept {
    return pool_->writable(slot);
  }
  /// Releases a slot and returns the buffer that this frees: none for a pool's slot or a buffer of
  /// a lost camera.
  std::optional<std::uint32_t> release(FrameSlot slot) noexcept;
  [[nodiscard]] std::size_t held() const noexcept { return held_; }

  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept;

 private:
  struct Entry {
    Mapping memory{};
    bool used = false, held = false;
    // True for the newest set of buffers.
    bool current = false;
    std::uint32_t buffer = 0;
    std::size_t offset = 0;
  };
  int width_ = 0, height_ = 0;
  std::size_t stride_ = 0;
  // Slots that are buffers.
  std::array<Entry, kMax> entries_{};
  // Entry of each buffer, or kNone if there was no room.
  std::vector<std::uint16_t> buffer_slots_;
  // Buffers of a camera whose images are converted.
  std::vector<Mapping> raw_;
  std::unique_ptr<Arena> arena_;
  std::unique_ptr<FramePool> pool_;
  std::size_t held_ = 0;
};

/// Minimum number of buffers left to the kernel, which drops frames without counting them if it has
/// none.
inline constexpr std::size_t kBufferReserve = 2;

/// Passes frames from the capture thread to the camera's users by a FrameQueue, and the kernel's
/// buffers back.
///
/// Threads  The comment above each group of calls names the thread. One mutex in addition to the
///          queue's is held for a few assignments, never during a system call.
/// Memory   Fixed, except for the Slots. If all are out, the newest frame is refused and counted as
///          an underrun.
class FrameExchange {
 public:
  /// List of buffers for the kernel.
  struct Buffers {
    std::array<std::uint32_t, Slots::kMax> index{};
    std::size_t count = 0;
    [[nodiscard]] std::span<const std::uint32_t> list() const noexcept {
      return std::span(index).first(count);
    }
  };

  // Calls of the owner.

  /// True while streaming or while images are in use.
  [[nodiscard]] bool busy() const noexcept;
  /// Selects grey images in the kernel's buffers, or images converted from them. Precondition: not
  /// busy.
  void use_buffers(int width, int height, std::size_t stride);
  void use_pool(int width, int height);
  /// Installs new buffers of the kernel; earlier ones have no owner.
  void install(std::vector<Mapping> mappings);
  /// All buffers that the kernel may have now. Precondition: no capture thread runs.
  [[nodiscard]] Buffers free_buffers() noexcept;
  /// Starts streaming and counts the start. `silence` as in FrameQueue::begin().
  void begin(Notifier* ready, Duration silence) noexcept;
  /// Ends streaming and wakes the waiting threads.
  void end() noexcept { queue_.end(); }
  /// Called after the capture thread has ended: frees buffers that were not consumed. Returns true
  /// if the node has died.
  [[nodiscard]] bool drain() noexcept;

  // Calls of any thread.
  [[nodiscard]] bool started() const noexcept { return queue_.started(); }
  /// → ok (it streams), stopped, disconnected
  [[nodiscard]] DeviceStatus standing() const noexcept { return queue_.standing(); }
  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept { return slots_.view(slot); }
  [[nodiscard]] CameraStatistics statistics() const noexcept { return queue_.statistics(); }

  // Calls of the consumer.
  [[nodiscard]] DeviceStatus wait(Duration limit, Frame* frame) noexcept {
    return queue_.wait(limit, frame);
  }
  // Calls of the releaser.

  /// Returns true if this frees a buffer for the capture thread.
  [[nodiscard]] bool release(FrameSlot slot) noexcept;

  // Calls of the capture thread.
  [[nodiscard]] Buffers pop_returned() noexcept;
  /// The slots, constant while streaming. The owner may call it while not streaming.
  [[nodiscard]] const Slots& slots() const noexcept { return slots_; }
  [[nodiscard]] std::span<std::uint8_t> writable(FrameSlot slot) noexcept {
    return slots_.writable(slot);
  }
  void count_lost(std::uint64_t exposures) noexcept { queue_.count_lost(exposures); }
  /// Holds the slot of a filled buffer, with its first pixel at `offset`. Returns nothing if the
  /// kernel, which has `with_kernel` others, would have too few. Precondition: slots().in_place().
  [[nodiscard]] std::optional<FrameSlot> hold_buffer(std::uint32_t index, std::size_t offset,
                                                     std::size_t with_kernel) noexcept;
  /// Holds a slot to convert into; nothing if all are out. Precondition: not slots().in_place().
  [[nodiscard]] std::optional<FrameSlot> hold_pooled() noexcept;
  /// Offers a held slot to the consumer; frees it if the stream was stopped meanwhile.
  void offer(const Frame& frame) noexcept;
  void record_dead_node() noexcept;
  /// Reports a disconnect; does nothing if stopped.
  void lose(HostStamp when) noexcept { queue_.lose(when); }

 private:
  [[nodiscard]] std::optional<FrameSlot> counted(std::optional<FrameSlot> slot) noexcept;

  FrameQueue queue_;
  // Guards the members below.
  mutable std::mutex mutex_;
  Slots slots_;
  Buffers returned_{};
  bool node_died_ = false;
};

}  // namespace vergence::v4l2
