#pragma once
#include <cstdint>
#include <functional>
#include <utility>

#include "drivers/trigger.hpp"
#include "drivers/trigger_board/board_clock.hpp"
#include "drivers/trigger_board/board_line.hpp"
#include "drivers/trigger_board/pause_request.hpp"
#include "drivers/trigger_board/pulse_account.hpp"
#include "drivers/trigger_board/setup.hpp"
#include "firmware_iface/trigger/trigger.h"

namespace vergence::trigger_board {

/// What a board says by itself, counters since open.
struct ReceiverCounters {
  std::uint64_t frames_unknown =
      0;                     // right frames of a type or size that this protocol does not have
  std::uint64_t errors = 0;  // ERROR messages that no one waited for
  std::uint64_t reboots = 0;
  std::uint64_t pps_edges = 0, ins_edges = 0;
  TriggerStatus board{};  // its newest STATUS; all zero before the first
};

/// Sorts the frames that a board sends: events become numbered pulses with the host's time, PONGs
/// the fit of its clock, STATUS what state it is in.
///
/// States   Between hold() and stream() what comes is accounted for, but no pulse is handed out and
///          a change of the board is none: it is being set up.
/// Threads  One caller. Memory: none. Time: no call waits.
/// Errors   finding(): why the board must be set up anew.
class BoardReceiver final : public FrameSink {
 public:
  static constexpr int kMostRefused = 8;  // events in a row that cannot be
  /// Why reading ends and the board is set up anew.
  enum class Finding : std::uint8_t {
    none,
    reboot,   // another boot_id: it began again
    halted,   // it makes no pulses, or has another configuration
    invalid,  // numbers or ticks that cannot be, kMostRefused in a row
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
  /// What it said of a halt while it was being started is past.
  void forget_halt() noexcept;
  /// Of the newest frame, or of stream().
  [[nodiscard]] HostStamp last_frame() const noexcept { return last_frame_; }

  [[nodiscard]] BoardClock& clock() noexcept { return clock_; }
  [[nodiscard]] PulseAccount& account() noexcept { return account_; }
  [[nodiscard]] const ReceiverCounters& counters() const noexcept { return counters_; }
  /// Takes a median: not for every frame.
  [[nodiscard]] TimeQuality time_quality() const noexcept;

 private:
  void take_event(const TriggerEvent& event, HostStamp arrival) noexcept;
  void take_pong(const TriggerPong& pong, HostStamp departure) noexcept;
  void take_status(const TriggerStatus& status) noexcept;
  void take_error(const TriggerError& error) noexcept;
  [[nodiscard]] bool same_boot(std::uint32_t boot) noexcept;

  PauseRequest& pause_;
  const std::function<void(const Pulse&)> hand_out_;
  PulseAccount account_;
  BoardClock clock_;
  ReceiverCounters counters_{};
  std::uint32_t mark_ = 0;  // of the configuration, in STATUS
  Finding finding_ = Finding::none;
  bool known_boot_ = false;  // account_.boot() is one
  bool streaming_ = false;
  HostStamp last_frame_{};
};

}  // namespace vergence::trigger_board
