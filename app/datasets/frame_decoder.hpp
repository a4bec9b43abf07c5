#pragma once

#include "app/datasets/stereo_sequence.hpp"
#include "app/runtime/background_thread.hpp"
#include "core/memory/frame_pool.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

/// Frame of a sequence, decoded or not; passed through a ring.
struct DecodedPair {
  /// Index into the sequence.
  std::uint64_t frame = 0;
  Stamp stamp{};
  /// False: skipped, without slots; `kind` and `issue` state why.
  bool decoded = false;
  /// Left and right image.
  std::array<FrameSlot, 2> slots{};
  /// Time to read and decode both files.
  float decode_ms = 0;
  /// Kind of the event: image_missing, image_truncated, …, stamp_not_increasing.
  const char* kind = "";
  /// Message, ends with 0.
  std::array<char, 256> issue{};
};

/// Reads and decodes the images of a sequence ahead of the consumer, the two of a pair in parallel
/// on two own threads.
///
/// A frame is skipped if an image is missing, unreadable, truncated or of changed size, or if its
/// stamp does not increase (StereoPair::in_order). Skipped frames pass through the ring too, so
/// events stay in order.
///
/// Ownership  A decoded pair's slots belong to the consumer until release(). Sequence and pool must
///            outlive the decoder.
/// Threads    One consumer calls next() and release(). stop() is thread-safe; the destructor stops
///            and joins.
/// Full       Nothing is dropped: with kAhead waiting pairs, or without a free slot, the decoder
///            waits.
/// Errors     The constructor throws std::system_error if there is no thread.
class FrameDecoder {
 public:
  /// Pairs that compensate a slow disk; more would only use memory.
  static constexpr std::size_t kAhead = 8;
  /// Waiting, being decoded and being consumed.
  static constexpr std::size_t kSlots = 2 * (kAhead + 2);

  /// Decodes pairs [first, first + count) of the sequence, limited to its end. Precondition: the
  /// pool's images have the calibration's size, which is equal for both cameras.
  FrameDecoder(const StereoSequence& sequence, std::size_t first, std::size_t count,
               FramePool& pool);
  ~FrameDecoder();

  /// Waits for the next frame. Returns false, with *pair unchanged, at the end of the sequence or
  /// if stopped.
  [[nodiscard]] bool next(DecodedPair* pair) noexcept;
  /// Releases the slots of a decoded pair.
  void release(const DecodedPair& pair) noexcept;
  /// Wakes both sides. May be called twice.
  void stop() noexcept;

 private:
  void work();
  [[nodiscard]] DecodedPair decode(std::size_t index);
  /// Buffers for decoding one image into a slot.
  struct Workspace {
    // Content of the file.
    std::vector<std::uint8_t> bytes;
    // Mosaic of a raw sequence in the pool's rows, or both images of a side-by-side file.
    std::vector<std::uint8_t> mosaic;
  };
  /// Loads an image into the slot. Two calls may run in parallel with separate workspaces.
  [[nodiscard]] ImageFileStatus load(const std::string& name, FrameSlot slot, Workspace* work);
  /// Loads a file with both images side by side into the two slots in hand.
  [[nodiscard]] ImageFileStatus load_both(const std::string& name, Workspace* work);
  /// Repeats the attempt whenever the consumer frees something, until it succeeds. Returns false if
  /// stopped.
  template <class Attempt>
  [[nodiscard]] bool wait_until(const Attempt& attempt) noexcept;

  const StereoSequence& sequence_;
  std::size_t next_index_, end_;
  FramePool& pool_;
  std::array<Workspace, 2> workspaces_;
  // Slots in hand; those of a skipped pair serve the next one.
  std::array<FrameSlot, 2> own_{};
  std::size_t own_count_ = 0;
  // Latest stamp of a frame that was not skipped for its stamp.
  std::optional<Stamp> newest_;

  Ring<DecodedPair, kAhead> ring_;
  // Signalled by the decoder for a pair or the end.
  WakeEvent filled_;
  // Signalled by the consumer for room in the ring or free slots.
  WakeEvent freed_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> finished_{false};
  ThreadRunner both_{BackgroundThread::Role::reader};
  std::thread thread_;
};

}  // namespace vergence::app
