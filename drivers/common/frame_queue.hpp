#pragma once
#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include "core/memory/frame_pool.hpp"
#include "drivers/camera.hpp"

namespace vergence {

/// Time without an image after which a camera of this rate counts as disconnected:
/// ten intervals, two seconds at least. Zero, any time: it exposes when it is told to.
[[nodiscard]] Duration longest_silence(CameraTrigger trigger, double rate_hz) noexcept;

/// A camera's frames on their way from the transport to the consumer, who has which slot, and what
/// state the stream is in: wait() and release() of a CameraDevice.
///
///     queue.begin(ready);                                    // the owner's start()
///     if (!queue.offer(frame)) give_back(frame.slot);        // the transport, each image
///     if (lost_it) queue.lose(now);                          // `gone`, once all is handed out
///     if (queue.release(frame.slot)) give_back(frame.slot);  // the consumer's release()
///
/// Ownership  A slot that was offered is the queue's, one that was handed out the consumer's until
///            release(); what becomes of it then is the driver's.
/// Threads    Each call by whom its comment names. One mutex, held for a few assignments and the
///            Notifier's call only: after end() there are no notifications.
/// Memory     Fixed, a place for every slot there can be: it is never full.
/// Time       No call waits but wait(), which ends at its limit.
/// Errors     Nothing throws.
class FrameQueue {
 public:
  /// From streaming to gone by lose(); back: it is still gone, and start() may go on.
  enum class State : std::uint8_t { stopped, streaming, gone, back };

  // The owner.
  /// Streams from now on. What was offered and not taken stays to be drained first. `ready` may be
  /// null. `silence`: so long without an image, for the first one longer, and the device is gone;
  /// zero: it may rest.
  void begin(Notifier* ready, Duration silence = {}) noexcept;
  /// Stopped from now on; who waits is told.
  void end() noexcept;
  /// Ends a failed start: disconnected at this time, or since earlier (no `when`).
  void fail(HostStamp when) noexcept;
  void fail() noexcept;
  /// Takes out a frame that was offered and not consumed; false: there is none. Precondition:
  /// no thread offers.
  [[nodiscard]] bool drain(FrameSlot* slot) noexcept;
  void count_start() noexcept;

  // The transport.
  /// False: it does not stream, the slot stays the transport's. Precondition: the slot is neither
  /// offered nor held.
  [[nodiscard]] bool offer(const Frame& frame) noexcept;
  void count_lost(std::uint64_t exposures) noexcept;
  void count_underrun() noexcept;
  /// From streaming: the device is gone. What was offered is still handed out first. Elsewhere it
  /// does nothing.
  void lose(HostStamp when) noexcept;
  /// From gone: the stream can be begun again. The Notifier is told, again at every call.
  void ready_again() noexcept;

  // The consumer.
  /// As CameraDevice::wait(). Who has not waited for kAway cannot tell a silent device: the
  /// transport may have been held up as well.
  [[nodiscard]] DeviceStatus wait(Duration limit, Frame* frame) noexcept;
  // The releaser.
  /// False: the consumer does not have it.
  bool release(FrameSlot slot) noexcept;

  // Any thread.
  [[nodiscard]] State state() const noexcept;
  /// Streaming, gone or back: not stopped.
  [[nodiscard]] bool started() const noexcept { return state() != State::stopped; }
  /// Checks whether the device can be queried now. → ok (it streams), stopped, disconnected
  [[nodiscard]] DeviceStatus standing() const noexcept;
  /// Slots that the consumer has.
  [[nodiscard]] std::size_t held() const noexcept;
  /// Slots that are offered or that the consumer has.
  [[nodiscard]] std::size_t out() const noexcept;
  [[nodiscard]] bool is_out(FrameSlot slot) const noexcept;
  [[nodiscard]] CameraStatistics statistics() const noexcept;

 private:
  static constexpr Duration kAway = Duration::seconds(1);
  static constexpr Duration kFirstImage =
      Duration::seconds(10);  // after begin(), at least: sensors that power up take their time

  void hear() noexcept;
  [[nodiscard]] DeviceStatus wait_locked(std::unique_lock<std::mutex>* lock, Duration limit,
                                         Frame* frame) noexcept;
  [[nodiscard]] bool silent(HostStamp now) const noexcept;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::stopped;
  HostStamp disconnected_at_{};
  Duration silence_{};           // zero: no limit
  bool heard_any_ = false;       // an image since begin()
  HostStamp heard_{}, asked_{};  // the newest image; the end of the newest wait()
  Notifier* notifier_ = nullptr;
  std::array<Frame, FramePool::kMaxSlots> frames_{};  // offered, a ring
  std::size_t first_ = 0, offered_ = 0;
  std::uint64_t offered_slots_ = 0, held_slots_ = 0;  // a bit a slot
  CameraStatistics statistics_{};
};

}  // namespace vergence
