#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "app/datasets/image_file.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/runtime/background_thread.hpp"
#include "core/memory/frame_pool.hpp"
#include "core/memory/ring.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

/// One frame of a sequence, decoded or not. A value that goes through a ring.
struct DecodedPair {
  std::uint64_t frame = 0;  // index into the sequence
  Stamp stamp{};
  bool decoded = false;              // else skipped: no slots, and `kind` and `issue` state why
  std::array<FrameSlot, 2> slots{};  // left, right
  float decode_ms = 0;               // reading both files and decoding them
  const char* kind = "";  // of the event: image_missing, image_truncated, …, stamp_not_increasing
  std::array<char, 256> issue{};  // message, ends with 0
};

/// Reads and decodes the images of a sequence ahead of whoever consumes them, the two of a pair
/// side by side on two threads of its own.
///
/// A frame is skipped when an image is missing, unreadable or torn, when its size has changed since
/// it was checked, or when its stamp does not go forward with those around it
/// (StereoPair::in_order). Skipped frames come through the ring in their turn, so events stay in
/// order.
///
/// Ownership  A decoded pair's slots are the consumer's until release(). Sequence and pool outlive
///            the decoder.
/// Threads    next(), release(), one consumer. stop() from any thread; the destructor stops and
///            joins.
/// Full       Nothing is dropped: with kAhead pairs waiting, or no slot free, the decoder's thread
///            waits.
/// Errors     The constructor throws std::system_error when no thread can be had; next() and
///            release() throw nothing.
class FrameDecoder {
 public:
  static constexpr std::size_t kAhead = 8;  // pairs: evens out a slow disk; more is only memory
  static constexpr std::size_t kSlots = 2 * (kAhead + 2);  // waiting, being decoded, being consumed

  /// Pairs [first, first + count) of the sequence, cut at its end. Precondition: the pool's images
  /// have the calibration's size; both cameras' are the same.
  FrameDecoder(const StereoSequence& sequence, std::size_t first, std::size_t count,
               FramePool& pool);
  ~FrameDecoder();
  FrameDecoder(const FrameDecoder&) = delete;
  FrameDecoder& operator=(const FrameDecoder&) = delete;

  /// The next frame, waiting for it. False: the end of the sequence, or stopped; *pair untouched.
  [[nodiscard]] bool next(DecodedPair* pair) noexcept;
  /// Gives the slots of a decoded pair back.
  void release(const DecodedPair& pair) noexcept;
  /// Wakes both sides. Twice is harmless.
  void stop() noexcept;

 private:
  void work();
  [[nodiscard]] DecodedPair decode(std::size_t index);
  /// Buffers for decoding one image into a slot.
  struct Workspace {
    std::vector<std::uint8_t> bytes;  // of the file
    std::vector<std::uint8_t>
        mosaic;  // of a raw sequence, rows as the pool's; of one side by side, both images
  };
  /// A file's, or the store's, image of that size into rows `stride` bytes apart.
  [[nodiscard]] ImageFileStatus read(const std::string& name, ImageSize size, std::uint8_t* out,
                                     std::size_t stride, Workspace* work) const;
  /// One image into the slot. Two at once are fine, each with a workspace of its own.
  [[nodiscard]] ImageFileStatus load(const std::string& name, FrameSlot slot, Workspace* work);
  /// A file with both images side by side, into the two slots in hand.
  [[nodiscard]] ImageFileStatus load_both(const std::string& name, Workspace* work);
  /// Waits for a slot. False: stopped.
  [[nodiscard]] bool wait_for_slot(FrameSlot* slot) noexcept;
  /// Hands the pair over, waiting for room. False: stopped.
  [[nodiscard]] bool hand_over(const DecodedPair& pair) noexcept;

  const StereoSequence& sequence_;
  std::size_t next_index_, end_;
  FramePool& pool_;
  std::array<Workspace, 2> workspaces_;
  std::array<FrameSlot, 2> own_{};  // slots in hand: those of a skipped pair serve the next one
  std::size_t own_count_ = 0;
  Stamp newest_{};
  bool any_ = false;  // newest_ means something

  Ring<DecodedPair, kAhead> ring_;
  WakeEvent filled_;  // signalled by the decoder: a pair, or the end
  WakeEvent freed_;   // signalled by the consumer: room in the ring, slots in the pool
  std::atomic<bool> stop_{false};
  std::atomic<bool> finished_{false};
  ThreadRunner both_{BackgroundThread::Role::reader};
  std::thread thread_;
};

}  // namespace vergence::app
