#include <chrono>
#include <thread>

#include "drivers/acquisition/acquisition.hpp"

/// Reports of pulses on their way to the synchroniser, and what it wants of who makes them.
namespace vergence {

void Acquisition::take_board() {
  auto& head = board_head_;
  head.held = false;
  if (head.event) {
    head.gone = true;
    // As a camera: one that started and gave nothing is not gone once more.
    if (!head.back) push_event(DeviceEvent::Kind::board_gone, head.value.arrival);
    return;
  }
  if (head.back) {
    head.back = false;
    push_event(DeviceEvent::Kind::board_back, head.value.arrival);
  }
  take_pulse(head.value);
  if (options_.sync.mode == SyncMode::board) pause_pulses();
}

void Acquisition::take_pulse(const Pulse& reported) {
  if (options_.pulse_observer != nullptr)
    options_.pulse_observer->on_pulse(stamp_of(reported.arrival), reported,
                                      stamp_of(reported.host));
  const PulseMapper::Report report = pulse_mapper_.add(reported);
  const Pulse& pulse = report.pulse;
  if (report.rebooted && !sync_out_) {
    ++counters_.reboots;
    push_event(DeviceEvent::Kind::board_rebooted, pulse.arrival);
  }
  ++counters_.pulses;
  if (report.rebooted && !reported.mapped) counters_.board.restart();
  if (!sync_out_) counters_.board.note(pulse.edge, {pulse.host, pulse.host_error});
  if (!wants_pulses(options_.sync.mode)) return;
  sync_.pulse(pulse);
  note_proofs(pulse.arrival);
  give_up_mute_cameras(pulse.arrival);
}

void Acquisition::give_up_mute_cameras(HostStamp now) {
  constexpr Duration kLongest = Duration::seconds(10);
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    auto& head = heads_[k];
    if (head.gone || head.ended || head.held) continue;
    if (options_.sync.interval * ++head.pulses_without <= kLongest) continue;
    head.pulses_without = 0;
    cameras_[k]->stop();
    note_gone(static_cast<int>(k), now);
  }
}

void Acquisition::pause_pulses() {
  const std::uint32_t pulses = sync_.wants_pause();
  if (pulses == 0) return;
  ++counters_.pauses;
  if (options_.sync.mode == SyncMode::board) {
    if (trigger_->pause(pulses) != DeviceStatus::ok) ++counters_.pauses_refused;
    return;
  }
  const bool master = options_.sync.mode == SyncMode::master_strobe;
  const Duration gap = options_.sync.interval * (static_cast<std::int64_t>(pulses) + 1);
  if (!master && ins_->pause(gap) == DeviceStatus::ok) return;  // InsReading::resumed ends it
  // No other way than to stop who makes the pulses; meanwhile nothing else comes that could not
  // wait.
  if (master)
    cameras_[0]->stop();
  else
    ins_->stop();
  std::this_thread::sleep_for(std::chrono::nanoseconds(gap.ns()));
  const DeviceStatus status = master ? cameras_[0]->start(this) : ins_->start(this);
  if (status != DeviceStatus::ok) ++counters_.pauses_refused;
  if (master) {
    sync_.restarted(0);
    if (status != DeviceStatus::ok) heads_[0].gone = true;
  } else {
    ins_clock_->restart();
    sync_out_->restart();
    if (status != DeviceStatus::ok) ins_head_.gone = true;
  }
}

void Acquisition::note_proofs(HostStamp now) {
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    if (heads_[k].gone) continue;
    const auto change = pairing_.look(k, sync_.proven(static_cast<int>(k)), now);
    if (!change) continue;
    push_event(change->proven ? DeviceEvent::Kind::proven : DeviceEvent::Kind::acquiring, now,
               static_cast<int>(k), change->seconds);
  }
}

}  // namespace vergence
