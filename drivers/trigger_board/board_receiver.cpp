#include "drivers/trigger_board/board_receiver.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "drivers/trigger_board/pulse_account.hpp"

namespace vergence::trigger_board {

namespace {

constexpr std::int64_t kPingBytes =
    trigger_ping_payload_size + trigger_overhead + 3;  // COBS byte, and a 00 at either end
constexpr std::int64_t kEventBytes = trigger_event_payload_size + trigger_overhead + 2;

}  // namespace

void BoardClock::restart(Duration spread, bool pps) noexcept {
  ClockMapperOptions o;
  o.delay_spread = spread;
  o.resolution = Duration::microseconds(1);  // a tick
  resets_before_ += mappers_[0].resets();
  mappers_.fill(ClockMapper(o));
  turns_ = moving_ = pps;
  locked_ = false;
  forget();
  reopen(wire_);
}

void BoardClock::forget() noexcept {
  known_ = false;
  newest_tick_ = 0;
  backward_ = 0;
  used_ = 0;
}

void BoardClock::report_lock(bool locked, HostStamp now) noexcept {
  if (locked && !locked_) lock_began_ = now;
  locked_ = locked;
  // What was mapped while it moved is in the older one for so long.
  moving_ = turns_ && !(locked && now - lock_began_ > kTurn * 2);
}

void BoardClock::take_turns(HostStamp now) noexcept {
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
  for (Question& q : questions_) {
    if (q.open) ++totals_.unanswered;
    q.open = false;
  }
}

std::uint32_t BoardClock::ask(HostStamp t1) noexcept {
  const std::uint32_t token = next_token_++;
  Question& q = questions_[token % kOpen];
  if (q.open) ++totals_.unanswered;
  q = {token, t1, true};
  ++totals_.asked;
  return token;
}

PongWord BoardClock::answer(const TriggerPong& pong, HostStamp t4) noexcept {
  Question& q = questions_[pong.token % kOpen];
  if (!q.open || q.token != pong.token) {
    ++totals_.refused;
    return PongWord::unasked;
  }
  q.open = false;
  const HostStamp sent = q.sent + wire_ * kPingBytes;
  if (pong.sent < pong.received || pong.sent > kMostTicks) {
    ++totals_.refused;
    return PongWord::invalid;
  }
  const Duration inside =
      Duration::microseconds(static_cast<std::int64_t>(pong.sent - pong.received));
  const Duration rtt = (t4 - sent) - inside;
  // A tick at either end, and the board's clock may be slow.
  const Duration tolerance = Duration::microseconds(2) + inside / 1000;
  if (rtt < -tolerance) {
    ++totals_.refused;
    return PongWord::invalid;
  }
  if (pong.received < newest_tick_) {
    ++totals_.refused;
    if (++backward_ < kBackward) return PongWord::backward;
    ++totals_.resets;
    for (ClockMapper& m : mappers_) m.restart();
    forget();
    return PongWord::backward;
  }
  backward_ = 0;
  newest_tick_ = pong.received;  // not `sent`: the next question may have come while this answer
                                 // waited for the line
  take_turns(t4);
  for (ClockMapper& m : mappers_)
    m.ping(sent, stamp_of_tick(pong.received), stamp_of_tick(pong.sent),
           std::max(t4, sent + inside));
  known_ = true;
  ++answers_;
  ++totals_.answered;
  rtt_ns_[rtt_at_] = std::max<std::int64_t>(0, rtt.ns());
  rtt_at_ = (rtt_at_ + 1) % kRemembered;
  rtts_ = std::min(rtts_ + 1, kRemembered);
  return PongWord::taken;
}

MappedStamp BoardClock::map(DeviceStamp stamp, HostStamp arrival) noexcept {
  MappedStamp m = mappers_[used_].map(stamp, arrival - wire_ * kEventBytes);
  if (!known_) m.error = m.error + kUnseen;
  return with_room(m);
}

TimeQuality BoardClock::quality() const noexcept {
  TimeQuality t = totals_;
  t.resets += resets_before_ + mappers_[0].resets();
  t.drift_ppm = mappers_[used_].drift() * 1e6;
  if (rtts_ > 0) {
    std::array<std::int64_t, kRemembered> sorted = rtt_ns_;
    const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(rtts_),
               middle = sorted.begin() + static_cast<std::ptrdiff_t>(rtts_ / 2);
    std::nth_element(sorted.begin(), middle, end);
    t.rtt_median = Duration::nanoseconds(*middle);
    t.rtt_least = Duration::nanoseconds(*std::min_element(sorted.begin(), middle + 1));
    t.rtt_most = Duration::nanoseconds(*std::max_element(middle, end));
  }
  if (known_) t.error = with_room(mappers_[used_].at(stamp_of_tick(newest_tick_))).error;
  return t;
}

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
