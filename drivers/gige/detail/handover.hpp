#pragma once
#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>

#include "drivers/camera.hpp"

namespace vergence::gige {

/// Between the transport's thread and the camera's users: frames one way, slots back, and what
/// state the stream is in.
///
/// Ownership  A slot is the transport's, offered, the consumer's, then returned and the transport's
///            again.
/// Threads    Each call by whom its comment names. One mutex, held for a few assignments only.
/// Memory     Fixed. Full: of more than `most` slots out the newest frame is refused and counted as
///            an underrun.
class Handover {
 public:
  /// streaming, then lost, then ready again: start() may go on.
  enum class State : std::uint8_t { stopped, streaming, gone, back };

  // The owner.
  /// Forgets everything but the counters. Precondition: stopped, no slot out.
  void set_slots(std::size_t slots, std::size_t most);
  [[nodiscard]] bool any_out() const;
  /// What was offered and not taken goes back to the transport.
  void begin(Notifier* ready);
  /// The camera streams: one start more.
  void count_start();
  /// It does not: gone, as the supervisor would say.
  void fail(HostStamp when);
  void end();

  // The consumer.
  [[nodiscard]] DeviceStatus wait(Duration limit, Frame* frame);
  // The releaser.
  void release(FrameSlot slot);

  // The transport.
  /// False: refused, the slot stays the transport's.
  [[nodiscard]] bool offer(const Frame& frame);
  /// The next slot that came back; false: none.
  [[nodiscard]] bool returned(FrameSlot* slot);
  [[nodiscard]] bool is_out(FrameSlot slot) const;  // with a consumer
  void count_lost(std::uint64_t exposures);

  // The supervisor.
  /// From streaming; what was offered is still handed out first.
  void lose(HostStamp when);
  /// The stream can be begun again; those who wait are told, again at every call.
  void ready_again();

  [[nodiscard]] State state() const;
  [[nodiscard]] CameraStatistics statistics() const;

 private:
  enum class Where : std::uint8_t { transport, offered, consumer, returned };

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::stopped;
  HostStamp lost_at_{};
  Notifier* notifier_ = nullptr;
  std::size_t slots_ = 0, most_ = 0, out_ = 0;
  std::array<Where, FramePool::kMaxSlots> where_{};
  std::array<Frame, FramePool::kMaxSlots> frames_{};  // offered, a ring
  std::size_t first_ = 0, offered_ = 0;
  std::array<FrameSlot, FramePool::kMaxSlots> returned_{};
  std::size_t returned_count_ = 0;
  CameraStatistics statistics_{};
};

}  // namespace vergence::gige
