#include "drivers/trigger_board/board_clock.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace vergence::trigger_board
