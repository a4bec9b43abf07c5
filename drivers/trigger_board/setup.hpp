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

// Configuration of a trigger board in wire format.

/// Converts a request. On bad_configuration or unsupported, *message has the problem and its fix,
/// and *config is unchanged.
[[nodiscard]] DeviceStatus wire_configuration(const TriggerConfiguration& requested,
                                              const Options& options, const TriggerInfo& board,
                                              TriggerConfig* config, std::string* message);
[[nodiscard]] TriggerConfiguration to_configuration(const TriggerConfig& config) noexcept;
/// Deviations from the requested configuration; empty if there are none.
[[nodiscard]] std::string remark_about(const TriggerConfiguration& requested,
                                       const TriggerConfig& config);

/// Receiver of unsolicited frames.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void accept(const TriggerFrame& frame, const BoardLine::Times& times) noexcept = 0;
};

/// Requests to a trigger board, each with its answer: identification, halt, configuration, start.
///
/// Not thread-safe. Allocates only messages. No call takes more than a second, find() two per baud
/// rate. Statuses: disconnected (silent, or the link is), stopped (`stop` is set), unsupported
/// (another protocol version, or refused), failed; last_error() has the problem and its fix.
class Setup {
 public:
  /// `others` may be null.
  Setup(SerialLink& line, BoardLine& frames, const std::atomic<bool>& stop,
        FrameSink* others) noexcept
      : line_(line), frames_(frames), stop_(stop), others_(others) {}

  /// Identifies the trigger board at the given baud rate (0: at all rates in use).
  [[nodiscard]] DeviceStatus find(std::uint32_t baud, TriggerInfo* info);
  [[nodiscard]] DeviceStatus halt(TriggerStatus* status);
  /// Precondition: halted.
  [[nodiscard]] DeviceStatus configure(const TriggerConfig& config, TriggerStatus* status);
  [[nodiscard]] DeviceStatus start(TriggerStatus* status);

  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }

 private:
  enum class Answer : std::uint8_t { ok, refused, silent, disconnected, stopped };
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
  // Frame of the answer.
  TriggerFrame frame_{};
  std::uint8_t error_ = 0;
  std::string last_error_;
};

/// Mark that STATUS contains once this CONFIG is in effect.
[[nodiscard]] std::uint32_t configuration_mark(const TriggerConfig& config) noexcept;

}  // namespace vergence::trigger_board
