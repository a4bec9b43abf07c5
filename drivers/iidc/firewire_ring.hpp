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

/// libdc1394's DMA ring: its buffers are the slots of an IEEE 1394 camera.
///
/// The library hands its buffers out by counting, whatever was filled; which one was filled is told
/// by the order in which they were queued, kept here. So buffers can come back in any order, and
/// one that finds no taker goes back at once; kReserve stay with the kernel, that it never runs
/// dry.
/// Slots      Two ranges of kMaxBuffers: after an unplug images that are still held stay where they
///            are in one, the new ring takes the other.
/// Unplug     libdc1394's capture_stop fails on a node that is gone, and leaves mapping and
///            descriptor: they are undone here. (Some kilobytes of its heap stay.)
/// Ownership  The camera is the caller's and open from set_up() to end() or abandon().
/// Threads    set_up, resume, end, …: the owner, while no thread takes. take, refuse,
///            enqueue_returned: the stream's thread. give_back, bytes: any.
/// Memory     The kernel's and the library's, at set_up(). Time: no call waits for a frame.
/// Errors     Nothing throws but set_up(), where a message finds no memory.
class FirewireRing {
 public:
  static constexpr std::size_t kReserve = 3;

  /// Result of take().
  enum class Take : std::uint8_t { filled, nothing, gone };
  struct Filled {
    FrameSlot slot = 0;  // kept until give_back() or refuse()
    bool broken = false;
    bool spare = false;       // it can be kept: the kernel has enough without it
    std::uint64_t at_us = 0;  // of its first packet, by the system's clock; 0: not known
  };

  ~FirewireRing();
  FirewireRing() = default;
  FirewireRing(const FirewireRing&) = delete;
  FirewireRing& operator=(const FirewireRing&) = delete;

  // The owner.
  /// For the next set_up(). Precondition: !captured().
  void set_shape(const StreamShape& shape) noexcept { shape_ = shape; }
  [[nodiscard]] const StreamShape& shape() const noexcept { return shape_; }
  /// All buffers are with the kernel. `device`: the camera's node. → ok, disconnected,
  /// no_bandwidth, failed; then *error says why
  [[nodiscard]] DeviceStatus set_up(dc1394camera_t* camera, const std::string& device,
                                    std::string* error);
  /// Between set_up() and end() or abandon().
  [[nodiscard]] bool captured() const noexcept { return captured_; }
  /// Images of the ring in use are held.
  [[nodiscard]] bool any_kept() const noexcept;
  /// Goes on with a ring of which images are still held: what came meanwhile goes back.
  void resume() noexcept;
  /// Ends a capture whose node is there, if it still is. Precondition: !any_kept().
  void end() noexcept;
  /// Ends a capture whose node is gone or about to be closed, unless its images are in use.
  void abandon() noexcept;
  /// Unmaps what is left of captures that ended, once nothing in it is kept.
  void drop_orphans() noexcept;
  /// A range of slots is free for a ring beside the images that are held.
  [[nodiscard]] bool has_room() const noexcept;
  /// The next ring takes the range that is free. Precondition: !captured(), has_room().
  void use_free_range() noexcept;
  /// Images are no longer in use.
  void discard_kept() noexcept { kept_.clear(); }

  // The stream's thread. Precondition: captured().
  /// Readable when a buffer is filled.
  [[nodiscard]] int descriptor() const noexcept { return dc1394_capture_get_fileno(camera_); }
  [[nodiscard]] Take take(Filled* filled) noexcept;
  /// Gives back unused buffers of take().
  void refuse(FrameSlot slot) noexcept;
  void enqueue_returned() noexcept;

  // Any thread.
  /// True: a buffer of the ring in use came back, the stream's thread has something to enqueue.
  [[nodiscard]] bool give_back(FrameSlot slot) noexcept;
  [[nodiscard]] const std::uint8_t* bytes(FrameSlot slot) const noexcept;

 private:
  /// One range of slots and what is mapped for it.
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
  std::atomic<std::size_t> generation_{0};         // of maps_, in use
  std::array<std::uint8_t, kMaxBuffers> queue_{};  // buffers with the kernel, in order
  std::size_t queue_first_ = 0, queued_ = 0;
  SlotSet kept_;      // slots that the sink has
  SlotSet returned_;  // slots of this generation on their way back to the kernel
};

}  // namespace vergence::iidc
