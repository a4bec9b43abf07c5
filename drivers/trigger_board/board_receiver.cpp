#include "drivers/trigger_board/board_receiver.hpp"

#include <cstddef>

namespace vergence::trigger_board {

void BoardReceiver::begin_boot(std::uint32_t boot, std::uint32_t next, const TriggerConfig& config,
                               Duration delay_spread) noexcept {
  if (boot != account_.boot() || !known_boot_) {
    if (known_boot_) ++counters_.reboots;
    known_boot_ = true;
    account_.begin(boot, next);
    clock_.restart(delay_spread, config.pps_edge != trigger_edge_none);
    pause_.restart();  // what was requested of the other start is past
  } else if (account_.refused_in_row() >= kMostRefused) {
    account_.begin(boot, next);  // what it held against the board was wrong itself
  } else {
    account_.end(next, 0);
  }
  account_.set_intervals(config.rate_millihertz, config.vary_us);
}

void BoardReceiver::stream(HostStamp now) noexcept {
  streaming_ = true;
  last_frame_ = now;
}

void BoardReceiver::end(const TriggerStatus& status, std::uint32_t to_come) noexcept {
  counters_.board = status;
  if (status.boot_id == account_.boot()) account_.end(status.pulses, to_come);
}

void BoardReceiver::forget_halt() noexcept {
  if (finding_ == Finding::halted) finding_ = Finding::none;
}

TimeQuality BoardReceiver::time_quality() const noexcept {
  TimeQuality quality = clock_.quality();
  const TriggerStatus& board = counters_.board;
  quality.pps_locked = board.pps_locked != 0;
  const bool seen = board.boot_id != 0 && board.pps_age_ms != 0xFFFFFFFFU;
  quality.pps_age = seen ? Duration::milliseconds(board.pps_age_ms) : Duration::nanoseconds(-1);
  return quality;
}

/// False: the board has begun again since it was set up.
bool BoardReceiver::same_boot(std::uint32_t boot) noexcept {
  if (!streaming_ || boot == account_.boot()) return true;
  finding_ = Finding::reboot;
  return false;
}

void BoardReceiver::accept(const TriggerFrame& frame, const BoardLine::Times& times) noexcept {
  last_frame_ = times.arrival;
  const auto size = static_cast<std::size_t>(frame.size);
  TriggerEvent event;
  TriggerPong pong;
  TriggerStatus status;
  TriggerEdge edge;
  TriggerInfo info;
  TriggerError error;
  if (frame.type == trigger_event && trigger_get_event(frame.payload, size, &event)) {
    take_event(event, times.arrival);
  } else if (frame.type == trigger_pong && trigger_get_pong(frame.payload, size, &pong)) {
    take_pong(pong, times.departure);
  } else if (frame.type == trigger_status && trigger_get_status(frame.payload, size, &status)) {
    pause_.answered(frame.sequence);
    take_status(status);
  } else if (frame.type == trigger_pps && trigger_get_edge(frame.payload, size, &edge)) {
    if (same_boot(edge.boot_id)) ++counters_.pps_edges;
  } else if (frame.type == trigger_ins && trigger_get_edge(frame.payload, size, &edge)) {
    if (same_boot(edge.boot_id)) ++counters_.ins_edges;
  } else if (frame.type == trigger_error && trigger_get_error(frame.payload, size, &error)) {
    take_error(error);
  } else if (frame.type != trigger_info ||
             !trigger_get_info(frame.payload, size,
                               &info)) {  // an INFO answers a question given up
    ++counters_.frames_unknown;
  }
}

void BoardReceiver::take_event(const TriggerEvent& event, HostStamp arrival) noexcept {
  if (!streaming_ || !same_boot(event.boot_id)) return;
  Pulse pulse;
  if (!account_.take(event, &pulse)) {
    if (account_.refused_in_row() >= kMostRefused) finding_ = Finding::invalid;
    return;
  }
  const MappedStamp mapped = clock_.map(pulse.edge, arrival);
  pulse.arrival = arrival;
  pulse.mapped = true;
  pulse.host = mapped.host;
  pulse.host_error = mapped.error;
  hand_out_(pulse);
}

void BoardReceiver::take_pong(const TriggerPong& pong, HostStamp departure) noexcept {
  if (!same_boot(pong.boot_id)) return;
  const std::uint64_t resets = clock_.resets_by_set_back();
  (void)clock_.answer(pong, departure);
  if (clock_.resets_by_set_back() != resets) account_.forget_time();
}

void BoardReceiver::take_status(const TriggerStatus& status) noexcept {
  counters_.board = status;
  clock_.report_lock(status.pps_locked != 0, last_frame_);
  if (!streaming_ || !same_boot(status.boot_id)) return;
  if (status.state == trigger_stopped || status.configuration != mark_) finding_ = Finding::halted;
}

void BoardReceiver::take_error(const TriggerError& error) noexcept {
  ++counters_.errors;
  if (error.refused != trigger_pause) return;
  pause_.refused();
  account_.forget_pause();
}

}  // namespace vergence::trigger_board
