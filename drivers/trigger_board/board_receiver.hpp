#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"
#include "drivers/trigger_board/board_line.hpp"
#include "drivers/trigger_board/pulse_counter.hpp"
#include "drivers/trigger_board/setup.hpp"
#include "firmware_iface/trigger/trigger.h"

namespace vergence::trigger_board {

/// Result of a PONG.
enum class PongStatus : std::uint8_t {
  taken,
  unasked,   // no such question is open
  invalid,   // it cannot be: sent before received, or longer in the board than under way
  backward,  // earlier than the one before
};

/// The board's clock on the host's, from pings.
///
/// Method   Every PING and its PONG give four stamps: t1 when it was handed to the line, t2 and t3
///          the board's ticks, t4 when its answer left the board at the latest (BoardLine). The
///          ClockMapper makes of them a line and a bound that no asymmetry can break: rtt / 2 at
///          worst. What bytes take on the wire at the baud rate is known, and not the same both
///          ways: it is taken out of t1 here, of t4 there. PPS moves the rate of the board's ticks,
///          as no crystal does: then two mappers take turns, each used when it is kTurn to 2 kTurn
///          old, and until the rate is there the bound has room for what it moves in that time
///          (kMoving).
/// Not thread-safe. Fixed memory.
/// Errors   PongStatus. kBackward answers in a row from an earlier time than before are a clock
///          that was set: the fit begins again.
class BoardClock {
 public:
  static constexpr std::size_t kOpen =
      64;  // questions that may be under way: more than half a second of them
  static constexpr int kBackward = 3;
  static constexpr Duration kUnseen = Duration::milliseconds(1);  // a USB frame
  static constexpr Duration kTurn = Duration::seconds(6);
  static constexpr Duration kMoving = Duration::microseconds(
      150);  // 8 ppm a second over 2 kTurn: an eighth of it times their square

  BoardClock() noexcept
      : mappers_{ClockMapper(ClockMapperOptions{}), ClockMapper(ClockMapperOptions{})} {}

  /// Another start of the board. `spread`: by how much the report of a stamp is late at worst, for
  /// stamps before the first answer.
  /// `pps`: something disciplines its ticks.
  void restart(Duration spread, bool pps) noexcept;
  /// PPS status of the board, about every second.
  void report_lock(bool locked, HostStamp now) noexcept;
  /// The line was opened again: what was under way is not answered any more. The fit stays. `wire`:
  /// a byte's time on it, 0 where it has none.
  void reopen(Duration wire) noexcept;

  /// A PING is being sent now: its token.
  [[nodiscard]] std::uint32_t ask(HostStamp t1) noexcept;
  /// `t4`: BoardLine's departure.
  [[nodiscard]] PongStatus answer(const TriggerPong& pong, HostStamp t4) noexcept;

  /// A ping has been answered since restart().
  [[nodiscard]] bool known() const noexcept { return known_; }
  /// Answers since restart() or reopen().
  [[nodiscard]] std::uint64_t answers() const noexcept { return answers_; }
  /// The host's time of an event, whose report was here at `arrival`. Before the first answer: from
  /// arrivals alone, which cannot tell the least time that the way takes; kUnseen is allowed for
  /// it.
  [[nodiscard]] MappedStamp map(DeviceStamp stamp, HostStamp arrival) noexcept;

  /// Times that answers showed a clock that was set back.
  [[nodiscard]] std::uint64_t resets() const noexcept { return resets_; }
  /// Answers that made no sense.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  struct Question {
    std::uint32_t token = 0;
    HostStamp sent{};
    bool open = false;
  };
  [[nodiscard]] PongStatus refuse(PongStatus why) noexcept;
  void reset() noexcept;
  void alternate_mappers(HostStamp now) noexcept;
  [[nodiscard]] MappedStamp with_room(MappedStamp m) const noexcept;

  std::array<ClockMapper, 2> mappers_;
  std::size_t used_ = 0;
  bool turns_ = false;   // they take turns
  bool moving_ = false;  // the rate of the ticks may be on its way
  HostStamp turn_began_{}, lock_began_{};
  bool locked_ = false;
  Duration wire_{};
  std::array<Question, kOpen> questions_{};
  std::uint32_t next_token_ = 1;
  bool known_ = false;
  std::uint64_t newest_tick_ = 0;
  int backward_ = 0;
  std::uint64_t answers_ = 0;
  std::uint64_t resets_ = 0, refused_ = 0;
};

/// Sorts the frames that a board sends: events become numbered pulses with the host's time, PONGs
/// the fit of its clock, STATUS what state it is in.
///
/// States   Between hold() and stream() what comes is accounted for, but no pulse is handed out and
///          a change of the board is none: it is being set up.
/// Not thread-safe. Does not allocate. Time: no call waits.
/// Errors   finding(): why the board must be set up anew.
class BoardReceiver final : public FrameSink {
 public:
  static constexpr int kMaxRefused = 8;  // events in a row that cannot be
  /// Why reading ends and the board is set up anew.
  enum class Finding : std::uint8_t {
    none,
    reboot,   // another boot_id: it began again
    halted,   // it makes no pulses, or has another configuration
    invalid,  // numbers or ticks that cannot be, kMaxRefused in a row
  };

  /// Pulses go to `hand_out`, requests of `pause` are answered; both outlive the receiver.
  BoardReceiver(PauseRequest& pause, std::function<void(const Pulse&)> hand_out)
      : pause_(pause), hand_out_(std::move(hand_out)) {}

  void accept(const TriggerFrame& frame, const BoardLine::Times& times) noexcept override;

  // ---- setting up
  /// A start of the board that has this configuration from now on: `next` is the number of its next
  /// pulse, `delay_spread` DeviceTiming's. The same boot as before goes on: what is missing since
  /// was lost.
  void begin_boot(std::uint32_t boot, std::uint32_t next, const TriggerConfig& config,
                  Duration delay_spread) noexcept;
  /// STATUS must have this mark of the configuration, else the board is halted.
  void expect_configuration(std::uint32_t mark) noexcept { mark_ = mark; }
  /// Pulses are handed out from here on.
  void stream(HostStamp now) noexcept;
  void hold() noexcept { streaming_ = false; }
  /// Pulses are over, as the board says in `status`, but for the reports `to_come`.
  void end(const TriggerStatus& status, std::uint32_t to_come) noexcept;

  [[nodiscard]] std::uint32_t boot() const noexcept { return account_.boot(); }
  [[nodiscard]] Finding finding() const noexcept { return finding_; }
  void clear_finding() noexcept { finding_ = Finding::none; }
  /// Clears a halt that was reported during the start.
  void clear_halt() noexcept;
  /// Time of the newest frame, or of stream().
  [[nodiscard]] HostStamp last_frame() const noexcept { return last_frame_; }

  [[nodiscard]] BoardClock& clock() noexcept { return clock_; }
  [[nodiscard]] PulseCounter& account() noexcept { return account_; }
  /// Right frames of a type or size that this protocol does not have.
  [[nodiscard]] std::uint64_t unknown_frames() const noexcept { return unknown_frames_; }
  [[nodiscard]] std::uint64_t reboots() const noexcept { return reboots_; }

 private:
  void handle_event(const TriggerEvent& event, HostStamp arrival) noexcept;
  void handle_pong(const TriggerPong& pong, HostStamp departure) noexcept;
  void pop_status(const TriggerStatus& status) noexcept;
  void handle_error(const TriggerError& error) noexcept;
  [[nodiscard]] bool same_boot(std::uint32_t boot) noexcept;

  PauseRequest& pause_;
  const std::function<void(const Pulse&)> hand_out_;
  PulseCounter account_;
  BoardClock clock_;
  std::uint64_t unknown_frames_ = 0, reboots_ = 0;
  std::uint32_t mark_ = 0;  // of the configuration, in STATUS
  Finding finding_ = Finding::none;
  bool known_boot_ = false;  // account_.boot() is one
  bool streaming_ = false;
  HostStamp last_frame_{};
};

}  // namespace vergence::trigger_board
