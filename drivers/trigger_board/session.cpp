#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <utility>

#include "drivers/trigger_board/device.hpp"

/// What the device's own thread does.
namespace vergence::trigger_board {
namespace {

constexpr Duration kPublish = Duration::milliseconds(100);  // statistics are as old as this at most
constexpr Duration kFirstPong =
    Duration::milliseconds(50);  // the first pings wait for their answers

constexpr Duration kPauseAgain = Duration::milliseconds(300);  // without an answer
constexpr int kPauseTurns = 3;

/// Nobody tells the last question to end: it is short.
const std::atomic<bool> kNever{false};

}  // namespace

void Device::interrupted(DeviceStatus status) noexcept {
  streaming_ = false;
  publish(false);
  if (status != DeviceStatus::ok && status != DeviceStatus::ended) ++counted_.gone;
}

void Device::finished() noexcept {
  if (line() != nullptr) halt_board();
  publish(true);
}

DeviceStatus Device::begin() noexcept {
  try {
    Setup setup(*line(), frames_, stopping(), this);
    const DeviceStatus status = begin_on(&setup);
    if (status != DeviceStatus::ok && status != DeviceStatus::stopped)
      (void)refuse(status, place().name() + ": " + setup.last_error());
    // What it will not do it does not do the next time either; but boards are switched, and
    // programs wait.
    return status == DeviceStatus::ok || status == DeviceStatus::stopped ||
                   status == DeviceStatus::ended
               ? status
               : DeviceStatus::gone;
  } catch (const std::exception&) {
    return DeviceStatus::gone;
  }
}

/// Who is there, what it shall do, what time it is, and off.
DeviceStatus Device::begin_on(Setup* setup) {
  seen_ = Seen::nothing;
  TriggerInfo who;
  DeviceStatus status = setup->find(line()->baud(), &who);
  if (status != DeviceStatus::ok) return status;
  clock_.reopen(byte_time());
  frames_.set_byte_time(byte_time());
  TriggerStatus board{};
  if (running_ && who.boot_id == account_.boot()) {
    // Its pulses may have gone on while the line was away, or it has stopped by itself: it goes on,
    // and what was missed counts.
    go_streaming(line()->now());
    status = setup->start(&board);
    if (status == DeviceStatus::ok && board.configuration == mark_) return started();
    streaming_ = false;
    if (status != DeviceStatus::ok && status != DeviceStatus::failed) return status;
  }
  status = setup->halt(&board);
  if (status == DeviceStatus::ok) status = setup->configure(config_, &board);
  if (status != DeviceStatus::ok) return status;
  if (who.boot_id != account_.boot() || !known_boot_) {
    if (known_boot_) ++counted_.reboots;
    known_boot_ = true;
    account_.begin(who.boot_id, board.pulses);
    clock_.restart(timing_.delay_spread, config_.pps_edge != trigger_edge_none);
    pause_.store(0, std::memory_order_relaxed);  // what was asked of the other start is past
    asked_pause_ = {};
  } else {
    account_.end(board.pulses, 0);
  }
  account_.set_intervals(config_.rate_millihertz, config_.vary_us);
  status = tie_clocks();
  if (status != DeviceStatus::ok) return status;
  running_ = true;
  go_streaming(line()->now());
  status = setup->start(&board);
  return status == DeviceStatus::ok ? started() : status;
}

/// What the board said by itself while it was being started is past.
DeviceStatus Device::started() noexcept {
  if (seen_ == Seen::halted) seen_ = Seen::nothing;
  return DeviceStatus::ok;
}

/// Before the first event is handed out.
void Device::go_streaming(HostStamp now) noexcept {
  report_streaming(now);
  streaming_ = true;
  heard_ = now;
}

/// Pings before the first pulse, so that it comes with its time.
DeviceStatus Device::tie_clocks() noexcept {
  for (int i = 0; i < kFirstPings; ++i) {
    const std::uint64_t before = clock_.answers();
    ping();
    const HostStamp until = line()->now() + kFirstPong;
    while (clock_.answers() == before && line()->now() < until) {
      if (stop_requested()) return DeviceStatus::stopped;
      const DeviceStatus status = read_one(until);
      if (status != DeviceStatus::ok && status != DeviceStatus::timeout &&
          status != DeviceStatus::stopped)
        return status;
    }
  }
  return DeviceStatus::ok;
}

/// → ok (it must be set up anew), stopped, ended, gone, failed
DeviceStatus Device::read_on() noexcept {
  HostStamp next_ping = line()->now();
  while (seen_ == Seen::nothing) {
    if (stop_requested()) return DeviceStatus::stopped;
    const HostStamp now = line()->now();
    send_pause(now);
    if (now - heard_ > kSilent) return DeviceStatus::gone;
    if (now >= next_ping) {
      ping();
      const double part = 1 + 0.2 * dither_.uniform(-1, 1);
      next_ping = now + Duration::nanoseconds(
                            std::llround(part * static_cast<double>(options_.ping_interval.ns())));
    }
    if (now - published_ >= kPublish || now < published_) {
      published_ = now;
      publish(false);
    }
    const DeviceStatus status = read_one(next_ping);
    if (status != DeviceStatus::ok && status != DeviceStatus::timeout &&
        status != DeviceStatus::stopped)
      return status;
  }
  if (seen_ == Seen::halted) ++counted_.restarts;
  if (seen_ != Seen::nonsense) return DeviceStatus::ok;
  running_ = false;
  try {
    (void)refuse(
        DeviceStatus::failed,
        place().name() +
            ": the trigger board's numbers or ticks run backwards; check its supply and firmware");
  } catch (const std::exception&) {  // out of memory: the counters say it
  }
  return DeviceStatus::failed;
}

DeviceStatus Device::read_one(HostStamp deadline) noexcept {
  TriggerFrame frame;
  BoardLine::Times times;
  const DeviceStatus status = frames_.next(deadline, &frame, &times);
  if (status == DeviceStatus::ok) accept(frame, times);
  return status;
}

DeviceStatus Device::reopen() {
  TriggerInfo who;
  return meet(&who);
}

/// With exposure feedback the last pulse's report comes after the answer to STOP, when its
/// exposures are over; nobody waits for it.
std::uint32_t Device::open_reports() const noexcept { return config_.feedback_inputs != 0 ? 1 : 0; }

/// No pulse after it, and the last ones are counted.
void Device::halt_board() noexcept {
  try {
    Setup setup(*line(), frames_, kNever, this);
    TriggerStatus status;
    const DeviceStatus done = setup.halt(&status);
    if (done == DeviceStatus::ok) counted_.board = status;
    if (done == DeviceStatus::ok && status.boot_id == account_.boot())
      account_.end(status.pulses, open_reports());
    if (done != DeviceStatus::ok) (void)refuse(done, place().name() + ": " + setup.last_error());
    if (done == DeviceStatus::gone) close_line();
  } catch (const std::exception&) {
    close_line();
  }
  running_ = streaming_ = false;
}

void Device::ping() noexcept {
  std::array<std::uint8_t, trigger_ping_payload_size> payload{};
  const TriggerPing message{clock_.ask(line()->now())};
  trigger_put_ping(&message, payload.data());
  if (frames_.send(trigger_ping, payload, nullptr) != DeviceStatus::ok) ++counted_.writes_refused;
}

/// Sends what was asked for, and again where no answer comes. One that was heard and whose answer
/// was lost makes another pause: a gap more, which its numbers tell.
void Device::send_pause(HostStamp now) noexcept {
  const std::uint32_t fresh = pause_.exchange(0, std::memory_order_acq_rel);
  if (fresh > 0)
    asked_pause_ = {asked_pause_.pulses + fresh, 0, 0, {}};
  else if (asked_pause_.pulses == 0 || now < asked_pause_.again)
    return;
  if (asked_pause_.turns == kPauseTurns) {
    asked_pause_ = {};
    return;
  }
  std::array<std::uint8_t, trigger_pause_payload_size> payload{};
  const TriggerPause message{asked_pause_.pulses};
  trigger_put_pause(&message, payload.data());
  ++asked_pause_.turns;
  asked_pause_.again = now + kPauseAgain;
  if (frames_.send(trigger_pause, payload, &asked_pause_.sequence) == DeviceStatus::ok)
    account_.expect_pause(asked_pause_.pulses);
  else
    ++counted_.writes_refused;
}

// ---- what comes in

/// False: the board has begun again since it was set up.
bool Device::same_boot(std::uint32_t boot) noexcept {
  if (!streaming_ || boot == account_.boot()) return true;
  seen_ = Seen::reboot;
  return false;
}

void Device::accept(const TriggerFrame& frame, const BoardLine::Times& times) noexcept {
  heard_ = times.arrival;
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
    if (asked_pause_.turns > 0 && frame.sequence == asked_pause_.sequence) asked_pause_ = {};
    take_status(status);
  } else if (frame.type == trigger_pps && trigger_get_edge(frame.payload, size, &edge)) {
    if (same_boot(edge.boot_id)) ++counted_.pps_edges;
  } else if (frame.type == trigger_ins && trigger_get_edge(frame.payload, size, &edge)) {
    if (same_boot(edge.boot_id)) ++counted_.ins_edges;
  } else if (frame.type == trigger_error && trigger_get_error(frame.payload, size, &error)) {
    ++counted_.errors;
    if (error.refused == trigger_pause) {
      asked_pause_ = {};
      account_.forget_pause();
    }
  } else if (frame.type != trigger_info ||
             !trigger_get_info(frame.payload, size,
                               &info)) {  // an INFO answers a question given up
    ++counted_.frames_unknown;
  }
}

void Device::take_event(const TriggerEvent& event, HostStamp arrival) noexcept {
  if (!streaming_ || !same_boot(event.boot_id)) return;
  Pulse pulse;
  if (!account_.take(event, &pulse)) {
    if (account_.refused_in_row() >= kMostRefused) seen_ = Seen::nonsense;
    return;
  }
  const MappedStamp mapped = clock_.map(pulse.edge, arrival);
  pulse.arrival = arrival;
  pulse.mapped = true;
  pulse.host = mapped.host;
  pulse.host_error = mapped.error;
  hand_out(pulse, arrival);
}

void Device::take_pong(const TriggerPong& pong, HostStamp departure) noexcept {
  if (!same_boot(pong.boot_id)) return;
  const std::uint64_t resets = clock_.resets_by_set_back();
  (void)clock_.answer(pong, departure);
  if (clock_.resets_by_set_back() != resets) account_.forget_time();
}

void Device::take_status(const TriggerStatus& status) noexcept {
  counted_.board = status;
  clock_.told_lock(status.pps_locked != 0, heard_);
  if (!streaming_ || !same_boot(status.boot_id)) return;
  if (status.state == trigger_stopped || status.configuration != mark_) seen_ = Seen::halted;
}

void Device::publish(bool last) noexcept {
  counted_.line = frames_.counters();
  counted_.pulses = account_.counters();
  counted_.time = clock_.quality();
  counted_.time.pps_locked = counted_.board.pps_locked != 0;
  const bool seen = counted_.board.boot_id != 0 && counted_.board.pps_age_ms != 0xFFFFFFFFU;
  counted_.time.pps_age =
      seen ? Duration::milliseconds(counted_.board.pps_age_ms) : Duration::nanoseconds(-1);
  // Whoever reads it holds the lock for a copy's time; the next tenth of a second will do as well.
  std::unique_lock lock(published_mutex_, std::defer_lock);
  if (last)
    lock.lock();
  else
    (void)lock.try_lock();
  if (lock.owns_lock()) published_statistics_ = counted_;
}

}  // namespace vergence::trigger_board
