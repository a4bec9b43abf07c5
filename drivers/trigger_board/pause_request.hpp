#pragma once
#include <atomic>
#include <cstdint>

#include "core/types/time.hpp"

namespace vergence::trigger_board {

/// Pulses that the board shall leave out: from the owner's request to the board's answer.
///
/// A message without an answer is sent again, kMostSent times in all. One whose answer alone was
/// lost makes another pause: a gap more, which the pulses' numbers show.
/// Threads  add(): any. The others: the board's thread, or the owner while there is none.
/// Memory   None.
///
///     if (const std::uint32_t pulses = request.due(now); pulses > 0)
///       request.sent(send_pause(pulses), now);
class PauseRequest {
 public:
  static constexpr Duration kAnswerLimit = Duration::milliseconds(300);
  static constexpr int kMostSent = 3;

  /// So many more pulses.
  void add(std::uint32_t pulses) noexcept {
    requested_.fetch_add(pulses, std::memory_order_release);
  }
  /// What was requested and has not been due() yet is none any more.
  void drop_new() noexcept { requested_.store(0, std::memory_order_relaxed); }
  /// Nor is what was sent: another start of the board.
  void restart() noexcept;

  /// The pulses of the message to send now, which sent() must follow. 0: none.
  [[nodiscard]] std::uint32_t due(HostStamp now) noexcept;
  /// Pulses of a message that was sent and waits for its answer. 0: none does.
  [[nodiscard]] std::uint32_t unanswered() const noexcept { return open_.pulses; }
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
