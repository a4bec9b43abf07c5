#include "drivers/trigger_board/pause_request.hpp"

namespace vergence::trigger_board {

void PauseRequest::restart() noexcept {
  drop_new();
  open_ = {};
}

std::uint32_t PauseRequest::due(HostStamp now) noexcept {
  const std::uint32_t added = requested_.exchange(0, std::memory_order_acq_rel);
  if (added > 0)
    open_ = {open_.pulses + added, 0, 0, {}};
  else if (open_.pulses == 0 || now < open_.again)
    return 0;
  if (open_.sent == kMostSent) open_ = {};
  return open_.pulses;
}

void PauseRequest::sent(std::uint8_t sequence, HostStamp now) noexcept {
  open_.sequence = sequence;
  ++open_.sent;
  open_.again = now + kAnswerLimit;
}

void PauseRequest::answered(std::uint8_t sequence) noexcept {
  if (open_.sent > 0 && sequence == open_.sequence) open_ = {};
}

}  // namespace vergence::trigger_board
