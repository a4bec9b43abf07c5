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

/// Frames of the trigger protocol on a line. They come one after the other, whoever asks for them:
/// an answer that was waited for and an event that came in the same read are both had.
///
/// Time     A converter hands bytes over in bursts, so the end of a frame says little about when it
///          was sent. But the last byte of a read was on the wire just before the burst left. Of a
///          frame that reads ended in, each of them bounds when its first bit left the
///          board: the arrival less what the bytes up to there take on the wire. The earliest of
///          these is the frame's departure.
/// Threads  One caller. Memory: in place. Errors: what is no frame is counted and passed over; the
///          next 00 is a new beginning.
class BoardLine {
 public:
  /// Timing of a frame.
  struct Times {
    HostStamp arrival{};    // of the read that completed it
    HostStamp departure{};  // of its first bit, at the latest
  };

  /// From another line, or the same anew: what was read before is forgotten, the counters go on.
  /// The line outlives its use.
  void attach(SerialLink* line) noexcept;
  /// A byte's time on the wire, 0 where it has none.
  void set_byte_time(Duration time) noexcept { byte_time_ = time; }
  [[nodiscard]] HostStamp now() const noexcept { return line_->now(); }
  /// Sends a frame, `sequence` (may be null): the number that its answer has. → ok, timeout,
  /// disconnected, failed
  [[nodiscard]] DeviceStatus send(std::uint8_t type, std::span<const std::uint8_t> payload,
                                  std::uint8_t* sequence) noexcept;
  /// The next frame, reading until `deadline` of the line's clock.
  /// → ok, timeout, stopped (woken), ended, disconnected, failed
  [[nodiscard]] DeviceStatus next(HostStamp deadline, TriggerFrame* frame, Times* times) noexcept;

  /// Received bytes that form no frame.
  [[nodiscard]] std::uint64_t refused() const noexcept {
    return refused_before_ + decoder_.bad_coding + decoder_.bad_length + decoder_.bad_crc;
  }
  /// Guess about the first bytes if no frame has come since attach() or reset(). Empty:
  /// nothing was received, or frames were.
  [[nodiscard]] std::string received_instead() const;
  void reset() noexcept;

 private:
  void remember() noexcept;
  void record_byte(std::uint8_t byte) noexcept;
  void record_end_of_read() noexcept;

  SerialLink* line_ = nullptr;
  std::uint8_t sequence_ = 0;
  TriggerDecoder decoder_{};
  std::uint64_t refused_before_ = 0;         // by the decoders before this one
  std::array<std::uint8_t, 1024> buffer_{};  // of one read
  std::size_t used_ = 0, size_ = 0;
  HostStamp arrival_{};
  Duration byte_time_{};
  std::int64_t into_frame_ = 0;  // bytes of the frame that is being received
  bool bounded_ = false;         // departure_ is a bound of it
  HostStamp departure_{};
  std::array<char, 256> first_bytes_{};
  std::size_t first_size_ = 0;
  std::uint64_t frames_received_ = 0;
};

/// Pulses that the board shall leave out: from the owner's request to the board's answer.
///
/// A message without an answer is sent again, kMaxSent times in all. One whose answer alone was
/// lost makes another pause: a gap more, which the pulses' numbers show.
/// Threads  add(): any. The others: the board's thread, or the owner while there is none.
/// Memory   None.
///
///     if (const std::uint32_t pulses = request.due(now); pulses > 0)
///       request.sent(send_pause(pulses), now);
class PauseRequest {
 public:
  static constexpr Duration kAnswerLimit = Duration::milliseconds(300);
  static constexpr int kMaxSent = 3;

  /// So many more pulses.
  void add(std::uint32_t pulses) noexcept {
    requested_.fetch_add(pulses, std::memory_order_release);
  }
  /// Cancels a request that has not been due() yet.
  void drop_new() noexcept { requested_.store(0, std::memory_order_relaxed); }
  /// Nor is what was sent: another start of the board.
  void restart() noexcept;

  /// The pulses of the message to send now, which sent() must follow. 0: none.
  [[nodiscard]] std::uint32_t due(HostStamp now) noexcept;
  /// It went to the line with this sequence number.
  void sent(std::uint8_t sequence, HostStamp now) noexcept;
  /// A STATUS with this sequence number came; another message's is none of ours.
  void answered(std::uint8_t sequence) noexcept;
  /// The board will not do it.
  void refused() noexcept { open_ = {}; }

 private:
  struct Open {
    std::uint32_t pulses = 0;  // 0: none waits for its answer
    std::uint8_t sequence = 0;
    int sent = 0;
    HostStamp again{};
  };

  std::atomic<std::uint32_t> requested_{0};
  Open open_{};
};

}  // namespace vergence::trigger_board
