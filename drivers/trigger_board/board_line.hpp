#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/types/time.hpp"
#include "drivers/serial/serial_link.hpp"
#include "firmware_iface/trigger/trigger.h"

namespace vergence::trigger_board {

/// Sends and receives frames of the trigger protocol on a serial link. Frames are returned one at a
/// time, so an answer and an event of the same read are both received.
///
/// Time     A converter delivers bytes in bursts, so the end of a frame does not show when it was
///          sent. But the last byte of a read was on the wire just before the burst. Every read
///          that ends inside a frame thus bounds when its first bit left the trigger board: the
///          arrival minus the wire time of the bytes so far. The earliest bound is the frame's
///          departure.
/// Errors   Invalid bytes are counted and skipped up to the next 00.
///
/// Not thread-safe. Does not allocate.
class BoardLine {
 public:
  /// Timing of a frame.
  struct Times {
    /// Arrival of the read that completed the frame.
    HostStamp arrival{};
    /// Latest possible time of its first bit.
    HostStamp departure{};
  };

  /// Attaches another link, or the same one reopened: discards what was read and keeps the
  /// counters. The link must outlive its use.
  void attach(SerialLink* line) noexcept;
  /// Sets the time of a byte on the wire; 0 if it has none.
  void set_byte_time(Duration time) noexcept { byte_time_ = time; }
  [[nodiscard]] HostStamp now() const noexcept { return line_->now(); }
  /// Sends a frame. `sequence` (may be null) receives the number that the answer repeats. → ok,
  /// timeout, disconnected, failed
  [[nodiscard]] DeviceStatus send(std::uint8_t type, std::span<const std::uint8_t> payload,
                                  std::uint8_t* sequence) noexcept;
  /// Returns the next frame, reading until `deadline` on the link's clock. → ok, timeout, stopped
  /// (woken), ended, disconnected, failed
  [[nodiscard]] DeviceStatus next(HostStamp deadline, TriggerFrame* frame, Times* times) noexcept;

  /// Number of received bytes that form no frame.
  [[nodiscard]] std::uint64_t refused() const noexcept {
    return refused_before_ + decoder_.bad_coding + decoder_.bad_length + decoder_.bad_crc;
  }
  /// Guess about the first bytes if no frame was received since attach() or reset(); empty if
  /// nothing or frames were received.
  [[nodiscard]] std::string received_instead() const;
  void reset() noexcept;

 private:
  void remember() noexcept;
  void record_byte(std::uint8_t byte) noexcept;
  void record_end_of_read() noexcept;

  SerialLink* line_ = nullptr;
  std::uint8_t sequence_ = 0;
  TriggerDecoder decoder_{};
  // Count of the previous decoders.
  std::uint64_t refused_before_ = 0;
  // Data of one read.
  std::array<std::uint8_t, 1024> buffer_{};
  std::size_t used_ = 0, size_ = 0;
  HostStamp arrival_{};
  Duration byte_time_{};
  // Bytes of the frame being received.
  std::int64_t into_frame_ = 0;
  // True if departure_ is a bound for it.
  bool bounded_ = false;
  HostStamp departure_{};
  std::array<char, 256> first_bytes_{};
  std::size_t first_size_ = 0;
  std::uint64_t frames_received_ = 0;
};

/// Number of pulses that the trigger board is to omit, from the owner's request to the answer.
///
/// A message without an answer is sent at most kMaxSent times. If only the answer was lost, this
/// makes another pause: a further gap, which the pulses' numbers reveal. add() is thread-safe; the
/// other calls belong to the board's thread, or the owner while it does not run. Does not allocate.
///
///     if (const std::uint32_t pulses = request.due(now); pulses > 0)
///       request.sent(send_pause(pulses), now);
class PauseRequest {
 public:
  static constexpr Duration kAnswerLimit = Duration::milliseconds(300);
  static constexpr int kMaxSent = 3;

  /// Requests further pulses to be omitted.
  void add(std::uint32_t pulses) noexcept {
    requested_.fetch_add(pulses, std::memory_order_release);
  }
  /// Cancels a request that has not been due() yet.
  void drop_new() noexcept { requested_.store(0, std::memory_order_relaxed); }
  /// Cancels sent requests too, because the trigger board was restarted.
  void restart() noexcept;

  /// Pulses of the message to send now, followed by sent(); 0 if none.
  [[nodiscard]] std::uint32_t due(HostStamp now) noexcept;
  /// Records the sequence number of the sent message.
  void sent(std::uint8_t sequence, HostStamp now) noexcept;
  /// Handles a STATUS with this sequence number; ignores those of other messages.
  void answered(std::uint8_t sequence) noexcept;
  /// Cancels the message that the trigger board refused.
  void refused() noexcept { open_ = {}; }

 private:
  struct Open {
    // 0 if no message waits for its answer.
    std::uint32_t pulses = 0;
    std::uint8_t sequence = 0;
    int sent = 0;
    HostStamp again{};
  };

  std::atomic<std::uint32_t> requested_{0};
  Open open_{};
};

}  // namespace vergence::trigger_board
