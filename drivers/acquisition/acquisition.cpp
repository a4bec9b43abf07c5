#include "drivers/acquisition/acquisition.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <utility>

namespace vergence {

namespace {

ClockMapperOptions clock_options(const DeviceTiming& t) noexcept {
  ClockMapperOptions o;
  o.min_delay = t.min_delay;
  o.delay_spread = t.delay_spread;
  o.resolution = t.resolution;
  return o;
}

}  // namespace

Acquisition::Acquisition(std::vector<CameraDevice*> cameras, InsDevice* ins, TriggerDevice* trigger,
                         const Options& options)
    : cameras_(std::move(cameras)),
      ins_(ins),
      trigger_(trigger),
      options_(options),
      sync_(options.sync),
      heads_(cameras_.size()),
      pulse_mapper_(trigger_ != nullptr ? clock_options(trigger_->timing()) : ClockMapperOptions{}),
      queue_(cameras_, options.wait_when_full) {
  for (std::size_t k = 0; k < cameras_.size(); ++k) heads_[k].device = cameras_[k];
  ins_head_.device = ins_;
  board_head_.device = trigger_;
  for (const CameraDevice* camera : cameras_) clocks_.emplace_back(clock_options(camera->timing()));
  if (ins_ != nullptr) ins_clock_ = std::make_unique<ClockMapper>(clock_options(ins_->timing()));
  if (options.sync.mode == SyncMode::ins_syncout) sync_out_.emplace(options.sync.interval);
}

Acquisition::~Acquisition() {
  stop();
  join();
}

std::optional<StartFailure> Acquisition::start(PulseObserver* observer) {
  options_.pulse_observer = observer;
  std::optional<StartFailure> failure;
  const auto start_device = [&](auto* device) {
    if (device == nullptr || failure) return;
    const DeviceStatus status = device->start(this);
    if (status != DeviceStatus::ok)
      failure = StartFailure{device->info(), status, device->last_error()};
  };
  const bool master = options_.sync.mode == SyncMode::master_strobe;
  for (std::size_t k = master ? 1 : 0; k < cameras_.size(); ++k) start_device(cameras_[k]);
  start_device(ins_);
  start_device(trigger_);
  if (master) start_device(cameras_[0]);
  if (!failure) thread_ = std::thread([this] { work(); });
  return failure;
}

void Acquisition::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  wake_.signal();
  queue_.stop();
}

void Acquisition::join() noexcept {
  if (thread_.joinable()) thread_.join();
  for (CameraDevice* camera : cameras_) camera->stop();
  if (ins_ != nullptr) ins_->stop();
  if (trigger_ != nullptr) trigger_->stop();
  counters_.sync = sync_.counters();
  for (std::size_t k = 0; k < cameras_.size(); ++k)
    counters_.verified[k] = sync_.verified(static_cast<int>(k));
  counters_.dropped_sets = queue_.skipped_sets();
  counters_.dropped_readings = queue_.dropped_readings();
  counters_.ring_high_water = queue_.high_water();
  counters_.clock_resets = ins_clock_ ? ins_clock_->resets() : 0;
  for (const CameraClock& clock : clocks_) counters_.clock_resets += clock.resets();
  counters_.clock_resets += pulse_mapper_.clock_resets();
}

Stamp Acquisition::stamp_of(HostStamp host) const noexcept {
  const std::int64_t ns = (options_.tie_stamp + (host - options_.tie_host)).ns(),
                     grid = options_.stamp_grid.ns();
  // Rounding is correct for stamps after 1970.
  return Stamp((ns + grid / 2) / grid * grid);
}

void Acquisition::work() {
  (void)pthread_setname_np(pthread_self(), "vergence-sync");
  while (!stop_.load(std::memory_order_acquire)) {
    rounds_.fetch_add(1, std::memory_order_relaxed);
    const WakeEvent::Ticket seen = wake_.ticket();
    // Polls twice, so that anything that arrived before an item of the first poll is found.
    poll();
    poll();
    const int device = earliest();
    if (device >= 0) {
      if (static_cast<std::size_t>(device) < cameras_.size())
        push_frame(static_cast<std::size_t>(device));
      else if (device == ins_place())
        push_reading();
      else
        poll_board();
      hand_out_sets();
      continue;
    }
    const bool over =
        std::all_of(heads_.begin(), heads_.end(), [](const auto& h) { return h.ended; }) &&
        ins_head_.ended;
    if (over) break;
    wake_.wait(seen);
  }
  sync_.finish();
  hand_out_sets();
  for (std::size_t k = 0; k < heads_.size(); ++k) {
    if (heads_[k].disconnected) missing_.push_back(static_cast<int>(k));
  }
  queue_.finish();
}

void Acquisition::poll() {
  for (std::size_t k = 0; k < heads_.size(); ++k) {
    auto& head = heads_[k];
    const bool held = head.held;
    head.poll(this, reconnect());
    if (options_.frame_observer != nullptr && !held && head.held && !head.event &&
        head.value.status == FrameStatus::complete)
      options_.frame_observer->on_frame(k, head.value);
  }
  poll_ins();
  board_head_.poll(this, reconnect());
}

void Acquisition::poll_ins() {
  ins_head_.poll(this, reconnect());
  if (ins_head_.reconnected) {
    ins_head_.reconnected = false;
    ins_clock_->restart();
    if (sync_out_) sync_out_->restart();
  }
  if (!ins_head_.held || !ins_head_.event) return;
  // Not reported here; the comparison reports missing samples.
  ins_head_.held = false;
  ins_head_.disconnected = true;
}

int Acquisition::earliest() const {
  int device = -1;
  HostStamp first{};
  for (std::size_t k = 0; k < heads_.size(); ++k)
    if (heads_[k].held && (device < 0 || heads_[k].value.arrival < first)) {
      device = static_cast<int>(k);
      first = heads_[k].value.arrival;
    }
  // At equal arrival pulses and then the INS go first, because the images may need them.
  if (ins_head_.held && (device < 0 || ins_head_.value.arrival <= first)) {
    device = ins_place();
    first = ins_head_.value.arrival;
  }
  if (board_head_.held && (device < 0 || board_head_.value.arrival <= first))
    device = ins_place() + 1;
  return device;
}

void Acquisition::push_frame(std::size_t k) {
  auto& head = heads_[k];
  head.held = false;
  const int camera = static_cast<int>(k);
  head.pulses_without = 0;
  if (head.event) {
    record_disconnect(camera, head.value.arrival);
    return;
  }
  if (head.reconnected) {
    head.reconnected = false;
    clocks_[k].restart();
    counters_.cameras[k].restart();
    pairing_.restarted(k);
    sync_.restarted(camera);
    push_event(DeviceEvent::Kind::camera_reconnected, head.value.arrival, camera);
  }
  const Frame& frame = head.value;
  SyncFrame in;
  in.camera = camera;
  in.slot = frame.slot;
  in.counter = frame.counter;
  in.middle = clocks_[k].exposure_start(frame);
  counters_.cameras[k].observe(frame.exposure_start, in.middle);
  in.middle.host = in.middle.host + frame.exposure / 2;
  in.arrival = frame.arrival;
  in.exposure_start = frame.exposure_start;
  in.exposure = frame.exposure;
  const bool incomplete = frame.status != FrameStatus::complete;
  counters_.incomplete += incomplete ? 1 : 0;
  if (incomplete) sync_.lost(in.camera, in.counter);
  const bool accepted = !incomplete && sync_.offer(in) == SyncResult::accepted;
  pairing_.frame(k);
  record_pairing_changes(frame.arrival);
  if (options_.sync.mode == SyncMode::master_strobe && k == 0) pause_pulses();
  if (accepted) return;
  AcquiredQueue::Refused refused;
  refused.set.present[k] = true;
  refused.set.slots[k] = frame.slot;
  queue_.push(refused);
}

void Acquisition::record_disconnect(int camera, HostStamp when) {
  auto& head = heads_[static_cast<std::size_t>(camera)];
  head.disconnected = true;
  sync_.absent(camera);
  // A device that restarted without data was not reported as reconnected, so it is not disconnected
  // again.
  if (!head.reconnected) push_event(DeviceEvent::Kind::camera_disconnected, when, camera);
}

void Acquisition::push_reading() {
  ins_head_.held = false;
  const InsReading& r = ins_head_.value;
  const MappedStamp at =
      r.mapped ? MappedStamp{r.host, r.host_error} : ins_clock_->map(r.measured, r.arrival);
  InsRecord item{r.sample, r.quality};
  item.sample.stamp = stamp_of(at.host);
  item.sample.stamp_error = at.error;
  counters_.ins.observe(r.measured, at);
  queue_.push(item);
  if (!sync_out_) return;
  if (r.resumed) sync_out_->restart();
  if (const auto pulse = sync_out_->reading(r, at)) {
    push_pulse(*pulse);
    pause_pulses();
  }
}

void Acquisition::hand_out_sets() {
  // Number of sets after which the clocks have settled.
  constexpr std::uint64_t kSettled = 30;
  AcquiredFrame item;
  SyncedSet& set = item.set;
  while (sync_.next(&set)) {
    item.rig = {set.number,
                stamp_of(set.stamp),
                set.error,
                set.spread,
                to_pairing(options_.sync.mode, set.proof),
                static_cast<int>(cameras_.size()),
                {}};
    if (set.number > kSettled)
      counters_.worst_stamp_error_ns = std::max(counters_.worst_stamp_error_ns, set.error.ns());
    queue_.push(item);
  }
}

void Acquisition::push_event(DeviceEvent::Kind kind, HostStamp when, int camera, double seconds) {
  queue_.push(DeviceEvent{kind, stamp_of(when), camera, seconds});
}

void Acquisition::poll_board() {
  auto& head = board_head_;
  head.held = false;
  if (head.event) {
    head.disconnected = true;
    // As for cameras, a restart without data is no reconnection.
    if (!head.reconnected)
      push_event(DeviceEvent::Kind::trigger_board_disconnected, head.value.arrival);
    return;
  }
  if (head.reconnected) {
    head.reconnected = false;
    push_event(DeviceEvent::Kind::trigger_board_reconnected, head.value.arrival);
  }
  push_pulse(head.value);
  if (options_.sync.mode == SyncMode::board) pause_pulses();
}

void Acquisition::push_pulse(const Pulse& reported) {
  if (options_.pulse_observer != nullptr)
    options_.pulse_observer->on_pulse(stamp_of(reported.arrival), reported,
                                      stamp_of(reported.host));
  const PulseMapper::Report report = pulse_mapper_.add(reported);
  const Pulse& pulse = report.pulse;
  if (report.rebooted && !sync_out_) {
    ++counters_.reboots;
    push_event(DeviceEvent::Kind::trigger_board_restarted, pulse.arrival);
  }
  ++counters_.pulses;
  if (report.rebooted && !reported.mapped) counters_.board.restart();
  if (!sync_out_) counters_.board.observe(pulse.edge, {pulse.host, pulse.host_error});
  if (!requires_pulses(options_.sync.mode)) return;
  sync_.pulse(pulse);
  record_pairing_changes(pulse.arrival);
  stop_silent_cameras(pulse.arrival);
}

void Acquisition::stop_silent_cameras(HostStamp now) {
  constexpr Duration kLongest = Duration::seconds(10);
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    auto& head = heads_[k];
    if (head.disconnected || head.ended || head.held) continue;
    if (options_.sync.interval * ++head.pulses_without <= kLongest) continue;
    head.pulses_without = 0;
    cameras_[k]->stop();
    record_disconnect(static_cast<int>(k), now);
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
  // InsReading::resumed ends the pause.
  if (!master && ins_->pause(gap) == DeviceStatus::ok) return;
  // The source of the pulses has to be stopped. Other data can wait meanwhile.
  if (master)
    cameras_[0]->stop();
  else
    ins_->stop();
  std::this_thread::sleep_for(std::chrono::nanoseconds(gap.ns()));
  const DeviceStatus status = master ? cameras_[0]->start(this) : ins_->start(this);
  if (status != DeviceStatus::ok) ++counters_.pauses_refused;
  if (master) {
    sync_.restarted(0);
    if (status != DeviceStatus::ok) heads_[0].disconnected = true;
  } else {
    ins_clock_->restart();
    sync_out_->restart();
    if (status != DeviceStatus::ok) ins_head_.disconnected = true;
  }
}

void Acquisition::record_pairing_changes(HostStamp now) {
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    if (heads_[k].disconnected) continue;
    const auto change = pairing_.update(k, sync_.verified(static_cast<int>(k)), now);
    if (!change) continue;
    push_event(
        change->verified ? DeviceEvent::Kind::pairing_verified : DeviceEvent::Kind::pairing_pending,
        now, static_cast<int>(k), change->seconds);
  }
}

}  // namespace vergence
