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
  accepted,
  /// No such ping is open.
  unasked,
  /// Impossible: sent before received, or longer on the trigger board than the round trip.
  invalid,
  /// Earlier than the previous one.
  backward,
};

/// Maps the trigger board's clock to the host's by pings.
///
/// Method   A PING and its PONG give four stamps: t1 when it was passed to the link, t2 and t3 the
///          board's ticks, t4 the latest departure of the answer (BoardLine). The ClockMapper turns
///          them into a line and a bound that holds for any asymmetry: rtt / 2 at worst. The known
///          wire time at the baud rate differs between the directions, so it is subtracted from t1
///          here and from t4 there. With PPS the rate of the ticks changes faster than a crystal's.
///          Then two mappers alternate, each used at an age of kTurn to 2 kTurn, and the bound
///          includes kMoving until the rate is stable.
/// Errors   PongStatus. kBackward answers in a row with earlier times mean a clock that was set,
///          which starts a new fit.
///
/// Not thread-safe. Fixed memory.
class BoardClock {
 public:
  /// Maximum number of open pings: more than half a second of them.
  static constexpr std::size_t kOpen = 64;
  static constexpr int kBackward = 3;
  /// Duration of a USB frame.
  static constexpr Duration kUnseen = Duration::milliseconds(1);
  static constexpr Duration kTurn = Duration::seconds(6);
  /// Effect of 8 ppm per second over 2 kTurn: an eighth of it times their square.
  static constexpr Duration kMoving = Duration::microseconds(150);

  BoardClock() noexcept
      : mappers_{ClockMapper(ClockMapperOptions{}), ClockMapper(ClockMapperOptions{})} {}

  /// Handles a start of the trigger board. `spread` is the maximum delay of a stamp's report, for
  /// stamps before the first answer. `pps` means that a signal disciplines the ticks.
  void restart(Duration spread, bool pps) noexcept;
  /// Handles the PPS status, received about every second.
  void report_lock(bool locked, HostStamp now) noexcept;
  /// Handles a reopened link: open pings will not be answered, the fit stays. `wire` is the time of
  /// a byte on the wire; 0 if it has none.
  void reopen(Duration wire) noexcept;

  /// Returns the token for a PING that is being sent.
  [[nodiscard]] std::uint32_t ask(HostStamp t1) noexcept;
  /// Handles a PONG; `t4` is BoardLine's departure.
  [[nodiscard]] PongStatus answer(const TriggerPong& pong, HostStamp t4) noexcept;

  /// True once a ping was answered since restart().
  [[nodiscard]] bool known() const noexcept { return known_; }
  /// Number of answers since restart() or reopen().
  [[nodiscard]] std::uint64_t answers() const noexcept { return answers_; }
  /// Maps an event, whose report came at `arrival`, to the host's clock. Before the first answer it
  /// uses arrivals only, which cannot reveal the minimum delay; the error then includes kUnseen.
  [[nodiscard]] MappedStamp map(DeviceStamp stamp, HostStamp arrival) noexcept;

  /// Number of times that the clock was set back.
  [[nodiscard]] std::uint64_t resets() const noexcept { return resets_; }
  /// Number of invalid answers.
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
  // True if the mappers alternate.
  bool turns_ = false;
  // True while the rate of the ticks may be changing.
  bool moving_ = false;
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

/// Dispatches the frames of a trigger board: events become numbered pulses in host time, PONGs
/// update its clock, STATUS its state.
///
/// Between hold() and stream() frames are counted but no pulse is handed out, and a changed state
/// is no finding, because the board is being configured. finding() has the reason to configure it
/// again. Not thread-safe. Does not allocate. No call waits.
class BoardReceiver final : public FrameSink {
 public:
  /// Maximum number of impossible events in a row.
  static constexpr int kMaxRefused = 8;
  /// Reason to stop reading and to configure the trigger board again.
  enum class Finding : std::uint8_t {
    none,
    /// Another boot_id: the trigger board has restarted.
    reboot,
    /// It makes no pulses, or has another configuration.
    halted,
    /// Impossible numbers or ticks, kMaxRefused in a row.
    invalid,
  };

  /// Passes pulses to `hand_out` and answers to `pause`; both must outlive the receiver.
  BoardReceiver(PauseRequest& pause, std::function<void(const Pulse&)> hand_out)
      : pause_(pause), hand_out_(std::move(hand_out)) {}

  void accept(const TriggerFrame& frame, const BoardLine::Times& times) noexcept override;

  // Calls for configuring.
  //
  // Handles a start of the trigger board with this configuration. `next` is the number of its next
  // pulse, `delay_spread` as in DeviceTiming. If the boot is the same, the pulses missing since
  // were lost.
  void begin_boot(std::uint32_t boot, std::uint32_t next, const TriggerConfig& config,
                  Duration delay_spread) noexcept;
  /// Sets the mark of the configuration that STATUS must have; otherwise the board counts as
  /// halted.
  void expect_configuration(std::uint32_t mark) noexcept { mark_ = mark; }
  /// Hands out pulses from now on.
  void stream(HostStamp now) noexcept;
  void hold() noexcept { streaming_ = false; }
  /// Handles the end of the pulses according to `status`, with `to_come` reports outstanding.
  void end(const TriggerStatus& status, std::uint32_t to_come) noexcept;

  [[nodiscard]] std::uint32_t boot() const noexcept { return account_.boot(); }
  [[nodiscard]] Finding finding() const noexcept { return finding_; }
  void clear_finding() noexcept { finding_ = Finding::none; }
  /// Clears a halt that was reported during the start.
  void clear_halt() noexcept;
  /// Arrival of the newest frame, or time of stream().
  [[nodiscard]] HostStamp last_frame() const noexcept { return last_frame_; }

  [[nodiscard]] BoardClock& clock() noexcept { return clock_; }
  [[nodiscard]] PulseCounter& account() noexcept { return account_; }
  /// Number of valid frames with a type or size that this protocol does not have.
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
  // Mark of the configuration in STATUS.
  std::uint32_t mark_ = 0;
  Finding finding_ = Finding::none;
  // True if account_.boot() is known.
  bool known_boot_ = false;
  bool streaming_ = false;
  HostStamp last_frame_{};
};

}  // namespace vergence::trigger_board
