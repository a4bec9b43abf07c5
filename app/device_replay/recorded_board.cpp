#include "app/device_replay/recorded_board.hpp"

#include <utility>

#include "firmware_iface/trigger/trigger.h"

namespace vergence::app {
namespace {

/// Pulses that a written message leaves out; 0: it is another message.
std::uint32_t pause_of(std::span<const std::uint8_t> bytes) noexcept {
  TriggerDecoder decoder{};
  TriggerFrame frame;
  TriggerPause pause;
  for (const std::uint8_t byte : bytes)
    if (trigger_decode(&decoder, byte, &frame) == trigger_frame_ready &&
        frame.type == trigger_pause &&
        trigger_get_pause(frame.payload, static_cast<std::size_t>(frame.size), &pause))
      return pause.pulses;
  return 0;
}

}  // namespace

RecordedBoard::RecordedBoard(std::unique_ptr<trigger_board::Device> board, RecordedPlace& line)
    : board_(std::move(board)) {
  line.before_writes([this](std::span<const std::uint8_t> bytes) {
    const std::uint32_t pulses = pause_of(bytes), open = board_->unanswered_pause();
    // No more than waits for its answer: the driver sends that again by itself.
    if (pulses > open) (void)board_->pause(pulses - open);
  });
}

}  // namespace vergence::app
