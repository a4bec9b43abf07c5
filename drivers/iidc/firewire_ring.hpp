#pragma once
#include <dc1394/dc1394.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

#include "drivers/iidc/bus.hpp"
#include "drivers/iidc/slot_memory.hpp"

namespace vergence::iidc {

/// libdc1394's DMA ring, whose buffers are the slots of an IEEE 1394 camera.
///
/// The library returns buffers in order of its counter, whichever was filled. The filled one
/// follows from the order of queueing, recorded here. So buffers may be released in any order.
/// kReserve buffers stay with the kernel, so that it never runs out.
/// Slots      Two ranges of kMaxBuffers. After a disconnect, held images keep their place in one
///            and the new ring takes the other.
/// Unplug     libdc1394's capture_stop fails on a disconnected node and leaves mapping and
///            descriptor, which are released here. (Some kilobytes of its heap are leaked.)
/// Ownership  The caller owns the camera and keeps it open from set_up() to end() or abandon().
/// Threads    The comment above each group of calls names the thread; the owner's calls require
///            that no thread is in pop().
/// Memory     Allocated by kernel and library in set_up(). No call waits for a frame.
/// Errors     Only set_up() may throw, std::bad_alloc.
class FirewireRing {
 public:
  static constexpr std::size_t kReserve = 3;

  /// Result of pop().
  enum class PopResult : std::uint8_t { filled, empty, disconnected };
  struct Filled {
    /// Held until give_back() or refuse().
    FrameSlot slot = 0;
    bool broken = false;
    /// True if the slot can be kept because the kernel has enough buffers without it.
    bool spare = false;
    /// Time of the first packet on the system's clock, in µs; 0 if unknown.
    std::uint64_t at_us = 0;
  };

  ~FirewireRing();
  FirewireRing() = default;
  FirewireRing(const FirewireRing&) = delete;
  FirewireRing& operator=(const FirewireRing&) = delete;

  // Calls of the owner.

  /// Sets the shape for the next set_up(). Precondition: !captured().
  void set_shape(const StreamShape& shape) noexcept { shape_ = shape; }
  [[nodiscard]] const StreamShape& shape() const noexcept { return shape_; }
  /// Starts a capture and queues all buffers. `device` is the camera's node. On failure *error has
  /// the reason. → ok, disconnected, no_bandwidth, failed
  [[nodiscard]] DeviceStatus set_up(dc1394camera_t* camera, const std::string& device,
                                    std::string* error);
  /// True between set_up() and end() or abandon().
  [[nodiscard]] bool captured() const noexcept { return captured_; }
  /// True if images of the present ring are held.
  [[nodiscard]] bool any_kept() const noexcept;
  /// Continues with a ring of which images are still held; returns those released meanwhile.
  void resume() noexcept;
  /// Ends a capture whose node still exists. Precondition: !any_kept().
  void end() noexcept;
  /// Ends a capture whose node is disconnected or about to be closed, unless its images are in use.
  void abandon() noexcept;
  /// Unmaps the remains of ended captures once none of their slots is kept.
  void drop_orphans() noexcept;
  /// True if a range of slots is free for a new ring.
  [[nodiscard]] bool has_room() const noexcept;
  /// Assigns the free range to the next ring. Precondition: !captured(), has_room().
  void use_free_range() noexcept;
  /// Called when images are no longer in use.
  void discard_kept() noexcept { kept_.clear(); }

  // Calls of the stream's thread. Precondition: captured().
  /// Descriptor that is readable when a buffer is filled.
  [[nodiscard]] int descriptor() const noexcept { return dc1394_capture_get_fileno(camera_); }
  [[nodiscard]] PopResult pop(Filled* filled) noexcept;
  /// Returns a buffer of pop() that is not used.
  void refuse(FrameSlot slot) noexcept;
  void enqueue_returned() noexcept;

  // Calls of any thread.

  /// Returns true if the buffer is of the present ring, so that the stream's thread has to enqueue
  /// it.
  [[nodiscard]] bool give_back(FrameSlot slot) noexcept;
  [[nodiscard]] const std::uint8_t* bytes(FrameSlot slot) const noexcept;

 private:
  /// Mapping of one range of slots.
  struct Map {
    std::uint8_t* base = nullptr;
    std::size_t length = 0;
    std::size_t stride = 0;
  };
  [[nodiscard]] bool find_map(const std::string& device);
  void detach_kept() noexcept;
  void enqueue(std::size_t buffer) noexcept;
  [[nodiscard]] bool dequeue(dc1394video_frame_t** frame) noexcept;
  [[nodiscard]] std::size_t pop_queued() noexcept;
  [[nodiscard]] std::size_t generation() const noexcept {
    return generation_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t kept_in(std::size_t generation) const noexcept {
    return kept_.bits() >> generation * kMaxBuffers & 0xFFFF'FFFFU;
  }

  dc1394camera_t* camera_ = nullptr;
  StreamShape shape_{};
  bool captured_ = false;
  std::array<Map, 2> maps_{};
  // Index of the present range in maps_.
  std::atomic<std::size_t> generation_{0};
  // Buffers queued in the kernel, in order.
  std::array<std::uint8_t, kMaxBuffers> queue_{};
  std::size_t queue_first_ = 0, queued_ = 0;
  // Slots held by the sink.
  SlotSet kept_;
  // Released slots of this generation that are to be enqueued.
  SlotSet returned_;
};

}  // namespace vergence::iidc
