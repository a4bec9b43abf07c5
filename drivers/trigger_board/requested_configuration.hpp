#pragma once
#include <string>

#include "drivers/trigger.hpp"
#include "drivers/trigger_board/options.hpp"
#include "firmware_iface/trigger/trigger.h"

/// What is asked of a board, as it goes over the wire.
namespace vergence::trigger_board {

/// → ok; bad_configuration, unsupported: *sentence says what is wrong and what to do, *config is as
///   it was.
[[nodiscard]] DeviceStatus wire_configuration(const TriggerConfiguration& requested,
                                              const Options& options, const TriggerInfo& board,
                                              TriggerConfig* config, std::string* sentence);
[[nodiscard]] TriggerConfiguration configuration_of(const TriggerConfig& config) noexcept;
/// What the board will do otherwise than asked. Empty: nothing.
[[nodiscard]] std::string remark_about(const TriggerConfiguration& requested,
                                       const TriggerConfig& config);

}  // namespace vergence::trigger_board
