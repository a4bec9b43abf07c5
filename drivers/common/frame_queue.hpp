#pragma once
#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include "core/memory/frame_pool.hpp"
#include "drivers/camera.hpp"

namespace vergence {

/// Time without an image after which a camera of this rate counts as disconnected: ten intervals,
/// at least two seconds. Zero disables the check, as for a camera that exposes only when triggered.
[[nodiscard]] Duration longest_silence(CameraTrigger trigger, double rate_hz) noexcept;

/// Queue of a camera's frames from the transport to the consumer. It tracks the owner of each slot
/// and the state of the stream, and implements wait() and release() of a CameraDevice.
///
///     queue.begin(ready);                                    // the owner's start()
///     if (!queue.offer(frame)) give_back(frame.slot);        // the transport, each image
///     if (lost_it) queue.lose(now);                          // `disconnected`, once drained
///     if (queue.release(frame.slot)) give_back(frame.slot);  // the consumer's release()
///
/// Ownership  An offered slot belongs to the queue, a handed-out slot to the consumer until
///            release(). After that it belongs to the driver again.
/// Threads    The comment above each group of calls names the thread. One mutex is held for a few
///            assignments and for the Notifier's call, so there are no notifications after end().
/// Memory     Fixed. The queue has room for every possible slot and is never full.
/// Time       Only wait() blocks, at most for its limit.
/// Errors     No call throws.
class FrameQueue {
 public:
  /// lose() leads from streaming to disconnected. `reconnected` means that the device has
  /// reconnected and start() can resume.
  enum class State : std::uint8_t { stopped, streaming, disconnected, reconnected };

  // Calls of the owner.

  /// Starts streaming. Frames that were offered and not handed out stay and are to be drained
  /// first. `ready` may be null. `silence` is the time without an image after which the device
  /// counts as disconnected (longer for the first image); zero disables this check.
  void begin(Notifier* ready, Duration silence = {}) noexcept;
  /// Stops streaming and wakes the thread in wait().
  void end() noexcept;
  /// Ends a failed start. The disconnect gets the time `when`, or keeps its earlier time.
  void fail(HostStamp when) noexcept;
  void fail() noexcept;
  /// Takes out a frame that was offered and not consumed; returns false if there is none.
  /// Precondition: no thread offers.
  [[nodiscard]] bool drain(FrameSlot* slot) noexcept;
  void count_start() noexcept;

  // Calls of the transport.

  /// Offers a frame. Returns false if the stream is not running; the slot then stays with the
  /// transport. Precondition: the slot is neither offered nor held.
  [[nodiscard]] bool offer(const Frame& frame) noexcept;
  void count_lost(std::uint64_t exposures) noexcept;
  void count_underrun() noexcept;
  /// Changes from streaming to disconnected. Frames offered before are still handed out. Does
  /// nothing in any other state.
  void lose(HostStamp when) noexcept;
  /// Changes from disconnected to reconnected, so that start() can resume, and notifies the
  /// Notifier at every call.
  void ready_again() noexcept;

  // Call of the consumer.

  /// Same contract as CameraDevice::wait(). A consumer that has not waited for kAway does not
  /// detect a silent device, because the transport may have been held up as well.
  [[nodiscard]] DeviceStatus wait(Duration limit, Frame* frame) noexcept;

  /// Call of the releaser. Returns false if the consumer does not hold the slot.
  bool release(FrameSlot slot) noexcept;

  // Calls of any thread.

  [[nodiscard]] State state() const noexcept;
  /// True if the state is not `stopped`.
  [[nodiscard]] bool started() const noexcept { return state() != State::stopped; }
  /// Returns whether the device can be queried now. → ok (it streams), stopped, disconnected
  [[nodiscard]] DeviceStatus standing() const noexcept;
  /// Number of slots held by the consumer.
  [[nodiscard]] std::size_t held() const noexcept;
  /// Number of slots that are offered or held by the consumer.
  [[nodiscard]] std::size_t out() const noexcept;
  [[nodiscard]] bool is_out(FrameSlot slot) const noexcept;
  [[nodiscard]] CameraStatistics statistics() const noexcept;

 private:
  static constexpr Duration kAway = Duration::seconds(1);
  // Minimum time for the first image after begin(), because sensors need time to power up.
  static constexpr Duration kFirstImage = Duration::seconds(10);

  void hear() noexcept;
  [[nodiscard]] DeviceStatus wait_locked(std::unique_lock<std::mutex>* lock, Duration limit,
                                         Frame* frame) noexcept;
  [[nodiscard]] bool silent(HostStamp now) const noexcept;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::stopped;
  HostStamp disconnected_at_{};
  // Zero means no limit.
  Duration silence_{};
  // True after the first image since begin().
  bool heard_any_ = false;
  // Time of the newest image, and end of the newest wait().
  HostStamp heard_{}, asked_{};
  Notifier* notifier_ = nullptr;
  // Ring of the offered frames.
  std::array<Frame, FramePool::kMaxSlots> frames_{};
  std::size_t first_ = 0, offered_ = 0;
  // Bit sets, indexed by slot.
  std::uint64_t offered_slots_ = 0, held_slots_ = 0;
  CameraStatistics statistics_{};
};

}  // namespace vergence
