#include "app/runtime/live_source.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr std::int64_t kAskAgain =
    1'000'000'000;  // ns: opening a bus device takes a while, a second more is no loss

std::int64_t steady_ns() noexcept {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

ClockMapperOptions clock_options(const DeviceTiming& t) noexcept {
  ClockMapperOptions o;
  o.least_delay = t.least_delay;
  o.delay_spread = t.delay_spread;
  o.resolution = t.resolution;
  return o;
}

void check(DeviceStatus status, const DeviceInfo& who, const std::string& message) {
  if (status == DeviceStatus::ok) return;
  const std::string why = message.empty()
                              ? std::string(to_string(status)) +
                                    "; check its cable and its section of the configuration"
                              : message;
  throw InputError(who.driver + " " + who.serial + " cannot be started: " + why);
}

}  // namespace

LiveSource::LiveSource(std::vector<CameraDevice*> cameras, InsDevice* ins, TriggerDevice* trigger,
                       const Options& options)
    : cameras_(std::move(cameras)),
      ins_(ins),
      trigger_(trigger),
      options_(options),
      sync_(options.sync),
      heads_(cameras_.size()) {
  for (const CameraDevice* camera : cameras_) clocks_.emplace_back(clock_options(camera->timing()));
  if (ins_ != nullptr) ins_clock_ = std::make_unique<ClockMapper>(clock_options(ins_->timing()));
  if (trigger_ != nullptr)
    board_clock_ = std::make_unique<ClockMapper>(clock_options(trigger_->timing()));
  if (options.sync.mode == SyncMode::ins_syncout)
    sync_out_.emplace(options.sync.interval, options.sync_out_divider);
}

LiveSource::~LiveSource() {
  stop();
  join();
}

void LiveSource::start() {
  const auto start_camera = [this](std::size_t k) {
    const DeviceStatus status = cameras_[k]->start(this);
    check(status, cameras_[k]->info(), cameras_[k]->last_error());
  };
  const bool master = options_.sync.mode == SyncMode::master_strobe;
  for (std::size_t k = master ? 1 : 0; k < cameras_.size(); ++k) start_camera(k);
  if (ins_ != nullptr) check(ins_->start(this), ins_->info(), ins_->last_error());
  if (trigger_ != nullptr) check(trigger_->start(this), trigger_->info(), trigger_->last_error());
  if (master) start_camera(0);
  thread_ = std::thread([this] { work(); });
}

void LiveSource::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  bell_.ring();
  filled_.ring();
  freed_.ring();
}

void LiveSource::join() noexcept {
  if (thread_.joinable()) thread_.join();
  for (CameraDevice* camera : cameras_) camera->stop();
  if (ins_ != nullptr) ins_->stop();
  if (trigger_ != nullptr) trigger_->stop();
  counters_.sync = sync_.counters();
  for (std::size_t k = 0; k < cameras_.size(); ++k)
    counters_.proven[k] = sync_.proven(static_cast<int>(k));
  counters_.dropped_sets = skipped_.load();
  counters_.clock_resets = ins_clock_ ? ins_clock_->resets() : 0;
  for (const ClockMapper& clock : clocks_) counters_.clock_resets += clock.resets();
  if (board_clock_) counters_.clock_resets += board_clock_->resets();
}

bool LiveSource::next(LiveItem* item) noexcept {
  for (;;) {
    const WakeEvent::Rung seen = filled_.look();
    const bool finished = finished_.load(
        std::memory_order_acquire);  // before the ring: what was pushed before is still found
    if (ring_.pop(item)) {
      freed_.ring();
      if (item->kind == LiveItem::Kind::refused) {
        release(item->set);
        continue;
      }
      if (item->kind != LiveItem::Kind::images) return true;
      const int behind = waiting_.fetch_sub(1, std::memory_order_acq_rel) - 1;
      if (options_.wait_when_full || behind < kMostWaiting) return true;
      release(item->set);
      skipped_.fetch_add(1, std::memory_order_relaxed);
      continue;
    }
    if (finished) return false;
    filled_.wait(seen);
  }
}

void LiveSource::release(const SyncedSet& set) noexcept {
  for (std::size_t k = 0; k < cameras_.size(); ++k)
    if (set.present[k]) cameras_[k]->release(set.slots[k]);
}

Stamp LiveSource::stamp_of(HostStamp host) const noexcept {
  const std::int64_t ns = (options_.tie_stamp + (host - options_.tie_host)).ns(),
                     grid = options_.stamp_grid.ns();
  return Stamp((ns + grid / 2) / grid * grid);  // after 1970
}

void LiveSource::work() {
  (void)pthread_setname_np(pthread_self(), "vergence-sync");
  while (!stop_.load(std::memory_order_acquire)) {
    const WakeEvent::Rung seen = bell_.look();
    // Twice: whatever arrived before an item of the first look is there at the second.
    for (int pass = 0; pass < 2; ++pass) {
      for (std::size_t k = 0; k < cameras_.size(); ++k) look(k);
      look_ins();
      look_board();
    }
    const int device = earliest();
    if (device >= 0) {
      if (static_cast<std::size_t>(device) < cameras_.size())
        take_frame(static_cast<std::size_t>(device));
      else if (device == ins_place())
        take_reading();
      else
        take_board();
      hand_out_sets();
      continue;
    }
    const bool over =
        std::all_of(heads_.begin(), heads_.end(), [](const auto& h) { return h.ended; }) &&
        ins_head_.ended;
    if (over) break;
    bell_.wait(seen);
  }
  sync_.finish();
  hand_out_sets();
  for (std::size_t k = 0; k < heads_.size(); ++k) {
    if (heads_[k].gone) missing_.push_back(static_cast<int>(k));
  }
  finished_.store(true, std::memory_order_release);
  filled_.ring();
}

void LiveSource::look(std::size_t k) {
  auto& head = heads_[k];
  if (head.held || head.ended) return;
  if (head.gone) {
    const std::int64_t now = steady_ns();
    if (!options_.wait_when_full && now - head.asked_ns < kAskAgain) return;
    head.asked_ns = now;
    const DeviceStatus status = cameras_[k]->start(this);
    if (status == DeviceStatus::ended) head.ended = true;
    if (status != DeviceStatus::ok) return;
    head.gone = false;
    head.back = true;
  }
  const DeviceStatus status = cameras_[k]->wait(Duration{}, &head.value);
  head.event = status == DeviceStatus::gone;
  head.held = status == DeviceStatus::ok || head.event;
  head.ended = status == DeviceStatus::ended || status == DeviceStatus::stopped;
}

void LiveSource::look_ins() {
  if (ins_ == nullptr) ins_head_.ended = true;
  if (ins_head_.held || ins_head_.ended) return;
  if (ins_head_.gone) {
    const std::int64_t now = steady_ns();
    if (!options_.wait_when_full && now - ins_head_.asked_ns < kAskAgain) return;
    ins_head_.asked_ns = now;
    DeviceStatus status = ins_->start(this);
    // Its time passes by itself: as long as it is not back, nothing says what else may go on.
    while (status == DeviceStatus::gone && ins_->keeps_own_time() &&
           !stop_.load(std::memory_order_acquire)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      status = ins_->start(this);
    }
    if (status == DeviceStatus::ended) ins_head_.ended = true;
    if (status != DeviceStatus::ok) return;
    ins_head_.gone = false;
    ins_clock_->restart();
    if (sync_out_) sync_out_->restart();
  }
  DeviceStatus status = DeviceStatus::timeout;
  do {
    constexpr Duration kLook = Duration::milliseconds(100);
    status = ins_->wait(ins_->keeps_own_time() ? kLook : Duration{}, &ins_head_.value);
  } while (status == DeviceStatus::timeout && ins_->keeps_own_time() &&
           !stop_.load(std::memory_order_acquire));
  ins_head_.gone = status == DeviceStatus::gone;
  ins_head_.held = status == DeviceStatus::ok;
  ins_head_.ended = status == DeviceStatus::ended || status == DeviceStatus::stopped;
}

void LiveSource::look_board() {
  auto& head = board_head_;
  if (trigger_ == nullptr) head.ended = true;
  if (head.held || head.ended) return;
  const bool own_time = options_.board_keeps_own_time;
  if (head.gone) {
    const std::int64_t now = steady_ns();
    if (!options_.wait_when_full && now - head.asked_ns < kAskAgain) return;
    head.asked_ns = now;
    DeviceStatus status = trigger_->start(this);
    while (status == DeviceStatus::gone && own_time && !stop_.load(std::memory_order_acquire)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      status = trigger_->start(this);
    }
    if (status == DeviceStatus::ended) head.ended = true;
    if (status != DeviceStatus::ok) return;
    head.gone = false;
    head.back = true;
  }
  DeviceStatus status = DeviceStatus::timeout;
  do {
    constexpr Duration kLook = Duration::milliseconds(100);
    status = trigger_->wait(own_time ? kLook : Duration{}, &head.value);
  } while (status == DeviceStatus::timeout && own_time && !stop_.load(std::memory_order_acquire));
  head.event = status == DeviceStatus::gone;
  head.held = status == DeviceStatus::ok || head.event;
  head.ended = status == DeviceStatus::ended || status == DeviceStatus::stopped;
}

int LiveSource::earliest() const {
  int device = -1;
  HostStamp first{};
  for (std::size_t k = 0; k < heads_.size(); ++k)
    if (heads_[k].held && (device < 0 || heads_[k].value.arrival < first)) {
      device = static_cast<int>(k);
      first = heads_[k].value.arrival;
    }
  // What keeps a time of its own may be ahead of the cameras: until one of them has something, an
  // earlier image may still come.
  const bool images_may_come =
      device < 0 &&
      std::any_of(heads_.begin(), heads_.end(), [](const auto& h) { return !h.ended && !h.gone; });
  const bool any_camera = device >= 0;
  // At the same instant pulses and then the INS go first: the images may need them.
  const bool ins_waits = images_may_come && ins_ != nullptr && ins_->keeps_own_time();
  if (ins_head_.held && !ins_waits && (!any_camera || ins_head_.value.arrival <= first)) {
    device = ins_place();
    first = ins_head_.value.arrival;
  }
  const bool board_waits = images_may_come && options_.board_keeps_own_time;
  if (board_head_.held && !board_waits && (device < 0 || board_head_.value.arrival <= first))
    device = ins_place() + 1;
  return device;
}

void LiveSource::take_frame(std::size_t k) {
  auto& head = heads_[k];
  head.held = false;
  LiveItem item;
  item.camera = static_cast<int>(k);
  item.stamp = stamp_of(head.value.arrival);
  if (head.event) {
    head.gone = true;
    sync_.absent(item.camera);
    item.kind = LiveItem::Kind::device_gone;
    push(item);
    return;
  }
  if (head.back) {
    head.back = false;
    clocks_[k].restart();
    counters_.cameras[k].restart();
    proofs_[k] = {};
    sync_.restarted(item.camera);
    item.kind = LiveItem::Kind::device_back;
    push(item);
  }
  const Frame& frame = head.value;
  SyncFrame in;
  in.camera = item.camera;
  in.slot = frame.slot;
  in.counter = frame.counter;
  // From the end of an exposure to the arrival is always as long, from its start not.
  if (exposures_[k] == Duration{}) exposures_[k] = frame.exposure;
  const Duration longer = frame.exposure - exposures_[k];
  in.middle = clocks_[k].map(frame.exposure_start + longer, frame.arrival);
  in.middle.host = in.middle.host - longer;
  counters_.cameras[k].note(frame.exposure_start, in.middle);
  in.middle.host = in.middle.host + frame.exposure / 2;
  in.arrival = frame.arrival;
  in.exposure_start = frame.exposure_start;
  in.exposure = frame.exposure;
  const bool torn = frame.status != FrameStatus::complete;
  counters_.torn += torn ? 1 : 0;
  if (torn) sync_.lost(in.camera, in.counter);
  const bool taken = !torn && sync_.offer(in) == SyncVerdict::taken;
  proofs_[k].any = true;
  note_proofs(frame.arrival);
  if (options_.sync.mode == SyncMode::master_strobe && k == 0) pause_pulses();
  if (taken) return;
  item.kind = LiveItem::Kind::refused;
  item.set.present[k] = true;
  item.set.slots[k] = frame.slot;
  push(item);
}

void LiveSource::take_reading() {
  ins_head_.held = false;
  LiveItem item;
  item.kind = LiveItem::Kind::reading;
  item.sample = ins_head_.value.sample;
  const InsReading& r = ins_head_.value;
  const MappedStamp at =
      r.mapped ? MappedStamp{r.host, r.host_error} : ins_clock_->map(r.measured, r.arrival);
  item.stamp = item.sample.stamp = stamp_of(at.host);
  item.sample.stamp_error = at.error;
  item.quality = r.quality;
  counters_.ins.note(r.measured, at);
  push(item);
  if (!sync_out_) return;
  if (const auto pulse = sync_out_->reading(r, at)) {
    take_pulse(*pulse);
    pause_pulses();
  }
}

void LiveSource::take_board() {
  auto& head = board_head_;
  head.held = false;
  LiveItem item;
  item.stamp = stamp_of(head.value.arrival);
  if (head.event) {
    head.gone = true;
    item.kind = LiveItem::Kind::board_gone;
    push(item);
    return;
  }
  if (head.back) {
    head.back = false;
    item.kind = LiveItem::Kind::board_back;
    push(item);
  }
  take_pulse(head.value);
  if (options_.sync.mode == SyncMode::board) pause_pulses();
}

void LiveSource::take_pulse(const Pulse& reported) {
  Pulse pulse = reported;
  const bool rebooted = any_pulse_ && pulse.boot != boot_;
  if (rebooted && !sync_out_) {
    ++counters_.reboots;
    LiveItem item;
    item.kind = LiveItem::Kind::board_rebooted;
    item.stamp = stamp_of(pulse.arrival);
    push(item);
  }
  any_pulse_ = true;
  boot_ = pulse.boot;
  ++counters_.pulses;
  if (!pulse.mapped) {
    if (rebooted) {
      board_clock_->restart();
      counters_.board.restart();
    }
    const MappedStamp at = board_clock_->map(pulse.edge, pulse.arrival);
    pulse.mapped = true;
    pulse.host = at.host;
    pulse.host_error = at.error;
  }
  if (!sync_out_) counters_.board.note(pulse.edge, {pulse.host, pulse.host_error});
  if (!wants_pulses(options_.sync.mode)) return;
  sync_.pulse(pulse);
  note_proofs(pulse.arrival);
}

void LiveSource::pause_pulses() {
  const std::uint32_t pulses = sync_.wants_pause();
  if (pulses == 0) return;
  ++counters_.pauses;
  if (options_.sync.mode == SyncMode::board) {
    if (trigger_->pause(pulses) != DeviceStatus::ok) ++counters_.pauses_refused;
    return;
  }
  // No other way than to stop who makes the pulses; meanwhile nothing else comes that could not
  // wait.
  const bool master = options_.sync.mode == SyncMode::master_strobe;
  if (master)
    cameras_[0]->stop();
  else
    ins_->stop();
  std::this_thread::sleep_for(std::chrono::nanoseconds(
      (options_.sync.interval * (static_cast<std::int64_t>(pulses) + 1)).ns()));
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

void LiveSource::note_proofs(HostStamp now) {
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    Proof& proof = proofs_[k];
    const bool proven = sync_.proven(static_cast<int>(k));
    if (proven == proof.proven || heads_[k].gone || !proof.any) continue;
    LiveItem item;
    item.kind = proven ? LiveItem::Kind::proven : LiveItem::Kind::acquiring;
    item.camera = static_cast<int>(k);
    item.stamp = stamp_of(now);
    item.seconds = proven ? (now - proof.since).to_seconds() : 0;
    proof = {true, proven, now};
    push(item);
  }
}

void LiveSource::hand_out_sets() {
  constexpr std::uint64_t kSettled = 30;  // sets, after which the clocks are known
  LiveItem item;
  item.kind = LiveItem::Kind::images;
  while (sync_.next(&item.set)) {
    item.stamp = stamp_of(item.set.stamp);
    if (item.set.number > kSettled)
      counters_.worst_stamp_error_ns =
          std::max(counters_.worst_stamp_error_ns, item.set.error.ns());
    push(item);
  }
}

void LiveSource::push(const LiveItem& item) {
  const bool images = item.kind == LiveItem::Kind::images;
  if (images) waiting_.fetch_add(1, std::memory_order_acq_rel);
  for (;;) {
    const WakeEvent::Rung seen = freed_.look();
    if (ring_.push(item)) break;
    if (stop_.load(std::memory_order_acquire)) return;  // nobody may be taking any more
    if (!options_.wait_when_full && item.kind == LiveItem::Kind::reading) {
      ++counters_.dropped_readings;
      return;
    }
    freed_.wait(seen);  // images: meanwhile the cameras drop, and count
  }
  counters_.ring_high_water = std::max(counters_.ring_high_water, ring_.size());
  filled_.ring();
}

}  // namespace vergence::app
