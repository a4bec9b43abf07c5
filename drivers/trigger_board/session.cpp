#include <array>
#include <cmath>
#include <exception>

#include "drivers/trigger_board/device.hpp"

/// Loop of the device's own thread.
namespace vergence::trigger_board {
namespace {

// Time for the answers to the first pings.
constexpr Duration kFirstPong = Duration::milliseconds(50);

/// The last request is short and not cancellable.
const std::atomic<bool> kNever{false};

}  // namespace

void Device::interrupted(DeviceStatus /*status*/) noexcept {
  receiver_.hold();
  publish(false);
}

void Device::finished() noexcept {
  if (line() != nullptr) halt_board();
  publish(true);
}

DeviceStatus Device::begin() noexcept {
  try {
    Setup setup(*line(), frames_, stopping(), &receiver_);
    const DeviceStatus status = begin_on(&setup);
    if (status != DeviceStatus::ok && status != DeviceStatus::stopped)
      last_error_.set(place().name() + ": " + setup.last_error());
    // A refusal would be repeated, but the trigger board may be replaced meanwhile.
    return status == DeviceStatus::ok || status == DeviceStatus::stopped ||
                   status == DeviceStatus::ended
               ? status
               : DeviceStatus::disconnected;
  } catch (const std::exception&) {
    return DeviceStatus::disconnected;
  }
}

/// Identifies, configures, synchronises and starts the trigger board.
DeviceStatus Device::begin_on(Setup* setup) {
  receiver_.clear_finding();
  TriggerInfo who;
  DeviceStatus status = setup->find(line()->baud(), &who);
  if (status != DeviceStatus::ok) return status;
  receiver_.clock().reopen(byte_time());
  frames_.set_byte_time(byte_time());
  receiver_.expect_configuration(mark_);
  TriggerStatus board{};
  if (running_ && who.boot_id == receiver_.boot()) {
    // Pulses may have continued while the link was down, or stopped; reading resumes and the missed
    // ones are counted.
    go_streaming(line()->now());
    status = setup->start(&board);
    if (status == DeviceStatus::ok && board.configuration == mark_) {
      receiver_.clear_halt();
      return status;
    }
    receiver_.hold();
    if (status != DeviceStatus::ok && status != DeviceStatus::failed) return status;
  }
  status = setup->halt(&board);
  if (status == DeviceStatus::ok) status = setup->configure(config_, &board);
  if (status != DeviceStatus::ok) return status;
  receiver_.begin_boot(who.boot_id, board.pulses, config_, timing_.delay_spread);
  status = tie_clocks();
  if (status != DeviceStatus::ok) return status;
  running_ = true;
  go_streaming(line()->now());
  status = setup->start(&board);
  if (status == DeviceStatus::ok) receiver_.clear_halt();
  return status;
}

/// Called before the first event is handed out.
void Device::go_streaming(HostStamp now) noexcept {
  report_streaming(now);
  receiver_.stream(now);
}

/// Sends pings before the first pulse, so that it can be mapped.
DeviceStatus Device::tie_clocks() noexcept {
  for (int i = 0; i < kFirstPings; ++i) {
    const std::uint64_t before = receiver_.clock().answers();
    const HostStamp now = line()->now();
    ping(now);
    const HostStamp until = now + kFirstPong;
    while (receiver_.clock().answers() == before && line()->now() < until) {
      if (stop_requested()) return DeviceStatus::stopped;
      const DeviceStatus status = read_one(until);
      if (status != DeviceStatus::ok && status != DeviceStatus::timeout &&
          status != DeviceStatus::stopped)
        return status;
    }
  }
  return DeviceStatus::ok;
}

/// → ok (configure it again), stopped, ended, disconnected, failed
DeviceStatus Device::read_on() noexcept {
  HostStamp next_ping = line()->now();
  while (receiver_.finding() == BoardReceiver::Finding::none) {
    if (stop_requested()) return DeviceStatus::stopped;
    const HostStamp now = line()->now();
    send_pause(now);
    if (now - receiver_.last_frame() > kSilent) return DeviceStatus::disconnected;
    if (now >= next_ping) {
      ping(now);
      const double part = 1 + 0.2 * dither_.uniform(-1, 1);
      next_ping = now + Duration::nanoseconds(
                            std::llround(part * static_cast<double>(options_.ping_interval.ns())));
    }
    publish(false);
    const DeviceStatus status = read_one(next_ping);
    if (status != DeviceStatus::ok && status != DeviceStatus::timeout &&
        status != DeviceStatus::stopped)
      return status;
  }
  if (receiver_.finding() != BoardReceiver::Finding::invalid) return DeviceStatus::ok;
  running_ = false;
  try {
    last_error_.set(
        place().name() +
        ": the trigger board's numbers or ticks run backwards; check its supply and firmware");
    // Out of memory; the counters still show it.
  } catch (const std::exception&) {
  }
  return DeviceStatus::failed;
}

DeviceStatus Device::read_one(HostStamp deadline) noexcept {
  TriggerFrame frame;
  BoardLine::Times times;
  const DeviceStatus status = frames_.next(deadline, &frame, &times);
  if (status == DeviceStatus::ok) receiver_.accept(frame, times);
  return status;
}

DeviceStatus Device::reopen() {
  TriggerInfo who;
  return meet(&who);
}

/// With exposure feedback the last pulse's report follows the answer to STOP, once its exposures
/// have ended. No thread waits for it.
std::uint32_t Device::open_reports() const noexcept { return config_.feedback_inputs != 0 ? 1 : 0; }

/// Stops the pulses and counts the last ones.
void Device::halt_board() noexcept {
  try {
    Setup setup(*line(), frames_, kNever, &receiver_);
    TriggerStatus status;
    const DeviceStatus done = setup.halt(&status);
    if (done == DeviceStatus::ok)
      receiver_.end(status, open_reports());
    else
      last_error_.set(place().name() + ": " + setup.last_error());
    if (done == DeviceStatus::disconnected) close_line();
  } catch (const std::exception&) {
    close_line();
  }
  running_ = false;
  receiver_.hold();
}

/// `now` is the clock reading that made the ping due: a recording stores one reading per write, and
/// its replay behaves alike.
void Device::ping(HostStamp now) noexcept {
  std::array<std::uint8_t, trigger_ping_payload_size> payload{};
  const TriggerPing message{receiver_.clock().ask(now)};
  trigger_put_ping(&message, payload.data());
  // A failure has no effect: the next ping follows.
  (void)frames_.send(trigger_ping, payload, nullptr);
}

void Device::send_pause(HostStamp now) noexcept {
  const std::uint32_t pulses = pause_.due(now);
  if (pulses == 0) return;
  std::array<std::uint8_t, trigger_pause_payload_size> payload{};
  const TriggerPause message{pulses};
  trigger_put_pause(&message, payload.data());
  std::uint8_t sequence = 0;
  const DeviceStatus status = frames_.send(trigger_pause, payload, &sequence);
  pause_.sent(sequence, now);
  if (status == DeviceStatus::ok) receiver_.account().expect_pause(pulses);
}

void Device::publish(bool last) noexcept {
  const PulseCounters& pulses = receiver_.account().counters();
  TriggerStatistics s;
  s.pulses = pulses.pulses;
  s.lost = pulses.lost;
  s.reboots = receiver_.reboots();
  s.malformed = pulses.refused + pulses.exposures_refused + frames_.refused() +
                receiver_.unknown_frames() + receiver_.clock().refused();
  // A reader holds the lock while it copies; the next round publishes instead.
  if (last)
    statistics_.set(s);
  else
    statistics_.offer(s);
}

}  // namespace vergence::trigger_board
