#pragma once
#include <memory>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "drivers/trigger_board/device.hpp"

namespace vergence::app {

/// Opens the trigger board and configures it; from then on it makes no pulse until it is started.
///
/// Errors  As refuse_device(), one sentence: the key, what was found, what to do. Nothing
///         stays open then.
/// `remarks`: sentences about what works, but not as asked.
[[nodiscard]] std::unique_ptr<trigger_board::Device> open_trigger_board(
    const TriggerSettings& settings, const TriggerConfiguration& pulses,
    std::vector<std::string>* remarks);

/// What the driver needs to know of a board of this configuration.
[[nodiscard]] trigger_board::Options trigger_board_options(const TriggerSettings& settings);

/// A board for a sentence: `trigger (board 3000…, on /dev/ttyACM0)`.
[[nodiscard]] std::string board_title(const DeviceInfo& info);

}  // namespace vergence::app
