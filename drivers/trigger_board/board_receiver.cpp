#include "drivers/trigger_board/board_receiver.hpp"

#include <algorithm>
#include <cstddef>

#include "drivers/trigger_board/pulse_counter.hpp"

namespace vergence::trigger_board {

namespace {

// Adds the COBS byte, and a 00 at either end.
constexpr std::int64_t kPingBytes = trigger_ping_payload_size + trigger_overhead + 3;
constexpr std::int64_t kEventBytes = trigger_event_payload_size + trigger_overhead + 2;

}  // namespace

void BoardClock::restart(Duration spread, bool pps) noexcept {
  ClockMapperOptions o;
  o.delay_spread = spread;
  // Resolution of a tick.
  o.resolution = Duration::microseconds(1);
  mappers_.fill(ClockMapper(o));
  turns_ = moving_ = pps;
  locked_ = false;
  reset();
  reopen(wire_);
}

void BoardClock::reset() noexcept {
  known_ = false;
  newest_tick_ = 0;
  backward_ = 0;
  used_ = 0;
}

void BoardClock::report_lock(bool locked, HostStamp now) noexcept {
  if (locked && !locked_) lock_began_ = now;
  locked_ = locked;
  // Pulses mapped while the clock changed stay in the older fit for this duration.
  moving_ = turns_ && !(locked && now - lock_began_ > kTurn * 2);
}

void BoardClock::alternate_mappers(HostStamp now) noexcept {
  if (!known_) turn_began_ = now;
  if (!turns_ || now - turn_began_ < kTurn) return;
  turn_began_ = now;
  mappers_[used_].restart();
  used_ = 1 - used_;
}

MappedStamp BoardClock::with_room(MappedStamp m) const noexcept {
  if (moving_) m.error = m.error + kMoving;
  return m;
}

void BoardClock::reopen(Duration wire) noexcept {
  wire_ = wire;
  answers_ = 0;
  for (Question& q : questions_) q.open = false;
}

std::uint32_t BoardClock::ask(HostStamp t1) noexcept {
  const std::uint32_t token = next_token_++;
  questions_[token % kOpen] = {token, t1, true};
  return token;
}

PongStatus BoardClock::refuse(PongStatus why) noexcept {
  ++refused_;
  return why;
}

PongStatus BoardClock::answer(const TriggerPong& pong, HostStamp t4) noexcept {
  Question& q = questions_[pong.token % kOpen];
  if (!q.open || q.token != pong.token) return refuse(PongStatus::unasked);
  q.open = false;
  const HostStamp sent = q.sent + wire_ * kPingBytes;
  if (pong.sent < pong.received || pong.sent > kMaxTicks) return refuse(PongStatus::invalid);
  const Duration inside =
      Duration::microseconds(static_cast<std::int64_t>(pong.sent - pong.received));
  const Duration rtt = (t4 - sent) - inside;
  // Allows for a tick at either end, and a slow clock of the trigger board.
  const Duration tolerance = Duration::microseconds(2) + inside / 1000;
  if (rtt < -tolerance) return refuse(PongStatus::invalid);
  if (pong.received < newest_tick_) {
    if (++backward_ >= kBackward) {
      ++resets_;
      for (ClockMapper& m : mappers_) m.restart();
      reset();
    }
    return refuse(PongStatus::backward);
  }
  backward_ = 0;
  // Not `sent`: the next ping may have come while this answer waited for the link.
  newest_tick_ = pong.received;
  alternate_mappers(t4);
  for (ClockMapper& m : mappers_)
    m.ping(sent, stamp_of_tick(pong.received), stamp_of_tick(pong.sent),
           std::max(t4, sent + inside));
  known_ = true;
  ++answers_;
  return PongStatus::accepted;
}

MappedStamp BoardClock::map(DeviceStamp stamp, HostStamp arrival) noexcept {
  MappedStamp m = mappers_[used_].map(stamp, arrival - wire_ * kEventBytes);
  if (!known_) m.error = m.error + kUnseen;
  return with_room(m);
}

void BoardReceiver::begin_boot(std::uint32_t boot, std::uint32_t next, const TriggerConfig& config,
                               Duration delay_spread) noexcept {
  if (boot != account_.boot() || !known_boot_) {
    if (known_boot_) ++reboots_;
    known_boot_ = true;
    account_.begin(boot, next);
    clock_.restart(delay_spread, config.pps_edge != trigger_edge_none);
    // Requests to the previous start are obsolete.
    pause_.restart();
  } else if (account_.refused_in_row() >= kMaxRefused) {
    // The expected number itself was wrong.
    account_.begin(boot, next);
  } else {
    account_.end(next, 0);
  }
  account_.set_intervals(config.rate_millihertz, config.dither_us);
}

void BoardReceiver::stream(HostStamp now) noexcept {
  streaming_ = true;
  last_frame_ = now;
}

void BoardReceiver::end(const TriggerStatus& status, std::uint32_t to_come) noexcept {
  if (status.boot_id == account_.boot()) account_.end(status.pulses, to_come);
}

void BoardReceiver::clear_halt() noexcept {
  if (finding_ == Finding::halted) finding_ = Finding::none;
}

/// Returns false if the trigger board has restarted since it was configured.
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
    handle_event(event, times.arrival);
  } else if (frame.type == trigger_pong && trigger_get_pong(frame.payload, size, &pong)) {
    handle_pong(pong, times.departure);
  } else if (frame.type == trigger_status && trigger_get_status(frame.payload, size, &status)) {
    pause_.answered(frame.sequence);
    pop_status(status);
  } else if ((frame.type == trigger_pps || frame.type == trigger_ins) &&
             trigger_get_edge(frame.payload, size, &edge)) {
    (void)same_boot(edge.boot_id);
  } else if (frame.type == trigger_error && trigger_get_error(frame.payload, size, &error)) {
    handle_error(error);
    // An INFO answers a request that was given up.
  } else if (frame.type != trigger_info || !trigger_get_info(frame.payload, size, &info)) {
    ++unknown_frames_;
  }
}

void BoardReceiver::handle_event(const TriggerEvent& event, HostStamp arrival) noexcept {
  if (!streaming_ || !same_boot(event.boot_id)) return;
  Pulse pulse;
  if (!account_.accept(event, &pulse)) {
    if (account_.refused_in_row() >= kMaxRefused) finding_ = Finding::invalid;
    return;
  }
  const MappedStamp mapped = clock_.map(pulse.edge, arrival);
  pulse.arrival = arrival;
  pulse.mapped = true;
  pulse.host = mapped.host;
  pulse.host_error = mapped.error;
  hand_out_(pulse);
}

void BoardReceiver::handle_pong(const TriggerPong& pong, HostStamp departure) noexcept {
  if (!same_boot(pong.boot_id)) return;
  const std::uint64_t resets = clock_.resets();
  (void)clock_.answer(pong, departure);
  if (clock_.resets() != resets) account_.clear_time();
}

void BoardReceiver::pop_status(const TriggerStatus& status) noexcept {
  clock_.report_lock(status.pps_locked != 0, last_frame_);
  if (!streaming_ || !same_boot(status.boot_id)) return;
  if (status.state == trigger_stopped || status.configuration != mark_) finding_ = Finding::halted;
}

void BoardReceiver::handle_error(const TriggerError& error) noexcept {
  if (error.refused != trigger_pause) return;
  pause_.refused();
  account_.clear_pause();
}

}  // namespace vergence::trigger_board
