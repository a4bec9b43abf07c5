#pragma once
#include <atomic>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/trigger.hpp"
#include "drivers/trigger_board/board_line.hpp"
#include "drivers/trigger_board/options.hpp"
#include "firmware_iface/trigger/trigger.h"

namespace vergence::trigger_board {

// Requested configuration of a board in wire format.

/// → ok; bad_configuration, unsupported: *message says what is wrong and what to do, *config is as
///   it was.
[[nodiscard]] DeviceStatus wire_configuration(const TriggerConfiguration& requested,
                                              const Options& options, const TriggerInfo& board,
                                              TriggerConfig* config, std::string* message);
[[nodiscard]] TriggerConfiguration to_configuration(const TriggerConfig& config) noexcept;
/// Deviations from the requested configuration; empty if none.
[[nodiscard]] std::string remark_about(const TriggerConfiguration& requested,
                                       const TriggerConfig& config);

/// Receiver of unsolicited frames.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void accept(const TriggerFrame& frame, const BoardLine::Times& times) noexcept = 0;
};

/// Questions to a board, each with its answer: who it is, halt, configuration, start.
///
/// Not thread-safe. Memory: none, but for the message of a refusal. Time: no call outlasts a
///          second, find() two a baud rate.
/// Errors   Statuses: gone (silent, or the line is), stopped (`stop` is set), unsupported (another
///          protocol version, or refused by the board), failed. last_error() says what and what to
///          do.
class Setup {
 public:
  /// `others` may be null.
  Setup(SerialLink& line, BoardLine& frames, const std::atomic<bool>& stop,
        FrameSink* others) noexcept
      : line_(line), frames_(frames), stop_(stop), others_(others) {}

  /// Asks who is there, at the baud rates that `baud` (0: all that boards use) allows.
  [[nodiscard]] DeviceStatus find(std::uint32_t baud, TriggerInfo* info);
  [[nodiscard]] DeviceStatus halt(TriggerStatus* status);
  /// Precondition: halted.
  [[nodiscard]] DeviceStatus configure(const TriggerConfig& config, TriggerStatus* status);
  [[nodiscard]] DeviceStatus start(TriggerStatus* status);

  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }

 private:
  enum class Answer : std::uint8_t { ok, refused, silent, gone, stopped };
  [[nodiscard]] Answer ask(std::uint8_t type, std::span<const std::uint8_t> payload,
                           std::uint8_t requested, Duration limit);
  [[nodiscard]] Answer listen(std::uint8_t type, std::uint8_t first, std::uint8_t last,
                              std::uint8_t requested, HostStamp until);
  template <class Fits>
  [[nodiscard]] DeviceStatus ask_status(std::uint8_t type, std::span<const std::uint8_t> payload,
                                        TriggerStatus* status, Fits fits);
  [[nodiscard]] DeviceStatus hello(Duration limit, TriggerInfo* info);
  [[nodiscard]] DeviceStatus other_version(unsigned theirs);
  [[nodiscard]] DeviceStatus verdict(Answer answer, std::uint8_t type);

  SerialLink& line_;
  BoardLine& frames_;
  const std::atomic<bool>& stop_;
  FrameSink* others_;
  TriggerFrame frame_{};  // the answer
  std::uint8_t error_ = 0;
  std::string last_error_;
};

/// CONFIG as it goes over the wire has this mark in STATUS once it is in effect.
[[nodiscard]] std::uint32_t configuration_mark(const TriggerConfig& config) noexcept;

}  // namespace vergence::trigger_board
