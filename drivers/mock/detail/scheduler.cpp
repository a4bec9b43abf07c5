#include "drivers/mock/detail/scheduler.hpp"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/mock/detail/oscillator.hpp"

namespace vergence::mock {

namespace {

/// The image that is delivered instead of this camera's own of this pulse.
void choose_image(const RigTruth& truth, const PulseAt& pulse, Exposure* e) noexcept {
  bool late = false;
  for (const Fault& f : truth.faults()) {
    if (!f.active(pulse.time)) continue;
    if (f.kind == FaultKind::lag && f.concerns(e->camera)) late = true;
    if (f.kind == FaultKind::swap_cables && e->camera < 2) e->camera = 1 - e->camera;
  }
  if (!late) return;
  const std::uint64_t i = pulse.number;
  e->time = pulse.time -
            (i == 0 ? pulse.plan->period() : pulse.plan->at(i).time - pulse.plan->at(i - 1).time);
  e->pulse = pulse.number - 1;
}

}  // namespace

Exposure make_exposure(const RigTruth& truth, std::uint64_t seed, const PulseAt& pulse,
                       int camera) noexcept {
  // Random stream of the draws that are made once per pulse.
  constexpr std::uint64_t kEveryCamera = 77;
  Exposure e;
  e.camera = camera;
  e.pulse = pulse.number;
  e.time = pulse.time;
  choose_image(truth, pulse, &e);
  std::uint64_t number = 0;
  for (const Fault& f : truth.faults()) {
    ++number;
    // Faults of the light apply to the camera and instant of the image; the rest,
    // the one that sends it and when.
    const bool light =
        f.kind == FaultKind::cover || f.kind == FaultKind::night || f.kind == FaultKind::exposure;
    if (light && f.active(e.time) && f.concerns(e.camera)) e.brightness *= f.factor;
    if (light || !f.active(pulse.time) || !f.concerns(camera)) continue;
    const std::uint64_t of_pulse = mixed(mixed(seed, pulse.number), number);
    Random random(of_pulse, static_cast<std::uint64_t>(camera));
    const bool drawn = random.uniform() < f.share;
    if (f.kind == FaultKind::lose_frames && drawn) e.lost = true;
    if (f.kind == FaultKind::late_frames && drawn) e.delay = e.delay + Duration::seconds(f.delay);
    if (f.kind == FaultKind::duplicate_frames && drawn) e.twice = true;
    if (f.kind == FaultKind::missed_trigger &&
        pulse.number < pulse.plan->first_from(f.at) + static_cast<std::uint64_t>(f.pulses))
      e.missed = true;
    if (f.kind == FaultKind::break_pairs) {
      Random together(of_pulse, kEveryCamera);
      const bool broken = together.uniform() < f.share;
      if (broken && static_cast<int>(together.below(
                        static_cast<std::uint32_t>(truth.mounted().cameras))) == camera)
        e.lost = true;
    }
  }
  return e;
}

namespace {

constexpr Duration kJitterMean = Duration::microseconds(150);
/// The jitter stays below DeviceTiming::delay_spread.
constexpr Duration kMaxJitter = Duration::microseconds(1900);

}  // namespace

Duration Scheduler::length() const noexcept {
  const Duration all = rig_.truth->drive().duration();
  return rig_.options.duration > Duration{} ? std::min(all, rig_.options.duration) : all;
}

PulsePlan Scheduler::make_plan(const TriggerConfiguration& c) const {
  return {c, length(), rig_.truth->faults()};
}

void Scheduler::begin(const TriggerConfiguration& c) {
  halt();
  board_ = c;
  plan_ = make_plan(c);
  stop_ = false;
  // The first images are rendered before they are due.
  constexpr Duration kLead = Duration::milliseconds(100);
  if (rig_.options.real_time) start_ = monotonic_now() + kLead;
  rig_.pulsing = true;
  queue_.begin();
  producer_ = std::thread([this] { produce(); });
}

void Scheduler::halt() noexcept {
  stop_.store(true, std::memory_order_release);
  rig_.room.signal();
  if (producer_.joinable()) producer_.join();
  queue_.join();
  rig_.pulsing = false;
}

std::uint64_t Scheduler::pulses(double rate_hz) const noexcept {
  return static_cast<std::uint64_t>(length().to_seconds() * rate_hz) + 1;
}

HostStamp Scheduler::jittered(HostStamp least, std::uint64_t device,
                              std::uint64_t number) const noexcept {
  Random random(mixed(rig_.options.seed, number), device);
  const double late = -static_cast<double>(kJitterMean.ns()) * std::log(1 - random.uniform());
  return least + std::min(kMaxJitter, Duration::nanoseconds(std::llround(late)));
}

// ---- making

void Scheduler::produce() {
  (void)pthread_setname_np(pthread_self(), "vergence-mock");
  for (std::uint64_t n = 0; !stopping() && n < plan_.size(); ++n) {
    while (rig_.options.reports_read && !rig_.options.real_time && !stopping()) {
      const WakeEvent::Ticket seen = rig_.room.ticket();
      if (trigger_->stream.empty() || !trigger_->stream.streaming()) break;
      rig_.room.wait(seen);
    }
    wait_for_exposures();
    make_readings(host_of(n + 4));
    make_link_events(n);
    if (left_out(n)) {
      for (Sender& s : senders_) ++s.counter_base;
      resumed_ = true;
      if (!rig_.options.real_time) queue_.deliver_until(host_of(n + 1));
      continue;
    }
    make_report(n);
    if (rig_.options.real_time && !wait_for_its_turn(n)) {
      for (const auto& camera : cameras_) camera->lost.fetch_add(1, std::memory_order_relaxed);
      continue;
    }
    make_frames(n);
    // Whatever is made later was measured at the next pulse or after it.
    if (!rig_.options.real_time) queue_.deliver_until(host_of(n + 1));
  }
  const std::uint64_t count = plan_.size();
  make_link_events(count);
  queue_.finish(host_of(count + 4) + Duration::seconds(11));
}

/// Every image of camera 0 that has arrived was looked at, and what was asked for then is known.
void Scheduler::wait_for_exposures() {
  while (rig_.options.exposures_follow && !rig_.options.real_time && !stopping()) {
    const WakeEvent::Ticket seen = rig_.room.ticket();
    if ((rig_.unseen.load() == 0 && !rig_.looking.load()) || !cameras_[0]->stream.streaming())
      break;
    rig_.room.wait(seen);
  }
}

/// Not further ahead than two pulses. False: the pulse is over before its pictures are begun.
bool Scheduler::wait_for_its_turn(std::uint64_t pulse) {
  const Duration period = plan_.period();
  while (monotonic_now() < host_of(pulse) - period * 2 && !stopping())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return monotonic_now() <= host_of(pulse) + period;
}

/// The line's going and coming until the next slot.
void Scheduler::make_link_events(std::uint64_t pulse) {
  const bool last = pulse + 1 >= plan_.size();
  for (; link_events_ < plan_.link().size(); ++link_events_) {
    const PulsePlan::LinkEvent& event = plan_.link()[link_events_];
    if (!last && event.time >= plan_.at(pulse + 1).time) return;
    QueuedDelivery p;
    p.device = kTriggerDevice;
    p.arrival = start_ + event.time;
    p.report.what = event.disconnected ? Delivery<BoardReport>::What::disconnected
                                       : Delivery<BoardReport>::What::reconnected;
    queue_.post(p);
  }
}

/// A pause that is due, in the boot that it was asked of.
bool Scheduler::left_out(std::uint64_t pulse) {
  const bool paused = pauses_.make(pulse, boot_of(pulse));
  rig_.planned.store(pulse + 1);
  return paused;
}

std::uint32_t Scheduler::boot_of(std::uint64_t pulse) const noexcept {
  return static_cast<std::uint32_t>(mixed(rig_.options.seed, 5000U + plan_.at(pulse).boot)) | 1U;
}

PulseAt Scheduler::pulse_at(std::uint64_t pulse, int k) const noexcept {
  return {pulse, plan_.at(pulse).time + cameras_[static_cast<std::size_t>(k)]->trigger_delay(),
          &plan_};
}

bool Scheduler::unplugged_at(Duration time, int k) const noexcept {
  return std::any_of(rig_.truth->faults().begin(), rig_.truth->faults().end(), [&](const Fault& f) {
    return f.kind == FaultKind::camera_disconnected && f.concerns(k) && f.active(time);
  });
}

PulseExposure Scheduler::feedback(std::uint64_t pulse, int k) const {
  const MockCamera& camera = *cameras_[static_cast<std::size_t>(k)];
  if (!pulsed(k) || unplugged_at(plan_.at(pulse).time, k) || !camera.stream.streaming()) return {};
  if (make_exposure(*rig_.truth, rig_.options.seed, pulse_at(pulse, k), k).missed) return {};
  const auto in_ticks = [](Duration d) { return Duration::microseconds((d.ns() + 500) / 1000); };
  return {true, in_ticks(camera.trigger_delay()),
          in_ticks(camera.trigger_delay() + camera.setting_at(pulse).exposure)};
}

void Scheduler::make_report(std::uint64_t pulse) {
  const HostStamp edge = host_of(pulse);
  const PulsePlan::Slot slot = plan_.at(pulse);
  QueuedDelivery p;
  p.device = kTriggerDevice;
  p.report.value.slot = pulse;
  Pulse& report = p.report.value.pulse;
  report.number = slot.number;
  report.boot = boot_of(pulse);
  report.resumed = resumed_ || slot.number == 0;
  resumed_ = false;
  // A boot's ticks begin with it; those of the first have been running for as long as the clock
  // says.
  const HostStamp booted = start_ + plan_.boot_time(slot.boot);
  report.edge = trigger_->clock().read(edge, slot.time, rig_.truth->faults());
  if (slot.boot > 0)
    report.edge = DeviceStamp(
        (report.edge - trigger_->clock().read(booted, slot.time, rig_.truth->faults())).ns());
  if (slot.boot > 0 && slot.number == 0) trigger_->reboots.fetch_add(1, std::memory_order_relaxed);
  // Delay after the edge.
  Duration reported{};
  for (int k = 0; k < static_cast<int>(cameras_.size()); ++k) {
    if ((board_.feedback >> static_cast<unsigned>(k) & 1U) == 0) continue;
    PulseExposure& e = report.exposure[static_cast<std::size_t>(k)];
    e = feedback(pulse, k);
    reported =
        std::max(reported, e.seen ? e.end : plan_.at(pulse + 1).time - slot.time - kReportLatency);
  }
  p.arrival = jittered(edge + std::max(reported, Duration{}) + kReportLatency, 20, pulse);
  // The report waits for exposures of any length, so the board's time is requested.
  if (board_.feedback != 0) {
    // Uncertainty in ns.
    constexpr double kKnown = 20e3;
    Random random(mixed(rig_.options.seed, pulse), 21);
    report.mapped = true;
    report.host = edge + Duration::nanoseconds(std::llround(random.uniform(-kKnown, kKnown)));
    report.host_error = Duration::microseconds(50);
  }
  if (plan_.link_down(slot.time) || plan_.link_down(p.arrival - start_)) {
    trigger_->lost.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  queue_.post(p);
}

void Scheduler::make_readings(HostStamp until) {
  if (!ins_.stream.streaming()) return;
  for (;; ++readings_) {
    const HostStamp at =
        start_ + Duration::seconds(static_cast<double>(readings_) / ins_.rate_hz());
    if (at >= until) return;
    const Duration time = at - start_;
    InsSample sample = ins_.model().sample(readings_, time);
    bool silent = false;
    for (const Fault& f : rig_.truth->faults())
      silent = silent || (f.kind == FaultKind::ins_disconnected && f.active(time));
    if (silent) {
      ins_.lost.fetch_add(1, std::memory_order_relaxed);
      continue;
    }
    QueuedDelivery p;
    p.device = kInsDevice;
    p.arrival = jittered(at + kInsLatency, 10, readings_);
    p.reading.value.sample = sample;
    p.reading.value.measured = ins_.clock().read(at, time, rig_.truth->faults());
    queue_.post(p);
  }
}

namespace {

constexpr Duration kNominalExposure = Duration::milliseconds(8);

}  // namespace

void Scheduler::make_frames(std::uint64_t pulse) {
  std::array<Shooting, kMaxCameras> shootings;
  std::size_t count = 0;
  for (int k = 0; k < static_cast<int>(cameras_.size()); ++k) {
    if (!present(pulse, k)) continue;
    if (const auto shooting = plan(pulse, k)) shootings[count++] = *shooting;
  }
  // Each camera renders with its own memory. A thread that lives for one pulse costs a thousandth
  // of a picture.
  const auto render_every_other = [&](std::size_t first) {
    for (std::size_t i = first; i < count; i += 2) render(shootings[i]);
  };
  std::thread beside;
  if (count > 1) beside = std::thread(render_every_other, 1);
  render_every_other(0);
  if (beside.joinable()) beside.join();
  for (std::size_t i = 0; i < count; ++i) send(pulse, shootings[i]);
}

bool Scheduler::present(std::uint64_t pulse, int k) {
  Sender& sender = senders_[static_cast<std::size_t>(k)];
  const bool disconnected = unplugged_at(plan_.at(pulse).time, k);
  if (disconnected != sender.unplugged) {
    QueuedDelivery p;
    p.device = k;
    // The transfer starts after the one in progress and before the next frame.
    p.arrival = host_of(pulse) + kTransfer;
    p.frame.what =
        disconnected ? Delivery<Frame>::What::disconnected : Delivery<Frame>::What::reconnected;
    queue_.post(p);
    sender.unplugged = disconnected;
    sender.counter_base = pulse;
  }
  return !disconnected && pulsed(k) && cameras_[static_cast<std::size_t>(k)]->stream.streaming();
}

std::optional<FrameSlot> Scheduler::get_slot(int k) {
  MockCamera& camera = *cameras_[static_cast<std::size_t>(k)];
  for (;;) {
    const WakeEvent::Ticket seen = rig_.room.ticket();
    if (stopping()) return std::nullopt;
    if (const auto slot = queue_.pop_spare(k)) return slot;
    if (const auto slot = camera.pool().acquire()) return slot;
    // Slots that only time will free are not waited for: late frames hold them.
    const bool held_by_delay = queue_.on_the_way(k) > static_cast<int>(MockRig::kSlots) / 2;
    if (rig_.options.real_time || held_by_delay || !camera.stream.streaming()) return std::nullopt;
    rig_.room.wait(seen);
  }
}

std::optional<Scheduler::Shooting> Scheduler::plan(std::uint64_t pulse, int k) {
  MockCamera& camera = *cameras_[static_cast<std::size_t>(k)];
  Shooting s;
  s.camera = k;
  s.exposure = make_exposure(*rig_.truth, rig_.options.seed, pulse_at(pulse, k), k);
  if (s.exposure.missed) {
    ++senders_[static_cast<std::size_t>(k)].counter_base;
    return std::nullopt;
  }
  if (s.exposure.lost) {
    camera.lost.fetch_add(1, std::memory_order_relaxed);
    return std::nullopt;
  }
  const auto slot = get_slot(k);
  if (!slot) {
    camera.underruns.fetch_add(1, std::memory_order_relaxed);
    return std::nullopt;
  }
  s.slot = *slot;
  s.setting = camera.setting_at(pulse);
  return s;
}

void Scheduler::send(std::uint64_t pulse, const Shooting& shooting) {
  const auto k = static_cast<std::size_t>(shooting.camera);
  MockCamera& camera = *cameras_[k];
  Sender& sender = senders_[k];
  const Duration open = shooting.setting.exposure;
  const HostStamp begins = host_of(pulse) + camera.trigger_delay();
  QueuedDelivery p;
  p.device = shooting.camera;
  p.arrival = jittered(begins + open + kTransfer, k, pulse) + shooting.exposure.delay;
  p.frame.value = {shooting.slot,
                   pulse - sender.counter_base,
                   camera.clock().read(begins, plan_.at(pulse).time, rig_.truth->faults()),
                   {},
                   open,
                   FrameStatus::complete,
                   shooting.setting.gain_db};
  camera.label(shooting.slot, pulse);
  std::optional<FrameSlot> copy;
  if (shooting.exposure.twice) copy = camera.pool().acquire();
  if (copy) {
    camera.label(*copy, pulse);
    const auto from = camera.pool().writable(shooting.slot), to = camera.pool().writable(*copy);
    std::memcpy(to.data(), from.data(), from.size());
    QueuedDelivery again = p;
    again.frame.value.slot = *copy;
    again.arrival = p.arrival + kTransfer;
    queue_.post(again);
  }
  queue_.post(p);
}

void Scheduler::render(const Shooting& shooting) {
  const Exposure& exposure = shooting.exposure;
  MockCamera& sender = *cameras_[static_cast<std::size_t>(shooting.camera)];
  const ExposureSetting& c = shooting.setting;
  std::vector<Transform> way, bus;
  for (int i = 0; i < rig_.options.blur_samples; ++i) {
    const Duration at = exposure.time + Duration::seconds((i + 0.5) / rig_.options.blur_samples *
                                                          c.exposure.to_seconds());
    way.push_back(rig_.truth->camera_in_enu(exposure.camera, at).inverse());
    if (const auto T_enu_bus = rig_.truth->bus_in_enu(at)) bus.push_back(way.back() * *T_enu_bus);
  }
  // The bus appears or disappears during the exposure.
  if (bus.size() != way.size()) bus.clear();
  RenderRequest shot;
  shot.exposure = exposure.brightness * c.exposure.to_seconds() / kNominalExposure.to_seconds() *
                  std::pow(10.0, c.gain_db / 20);
  if (rig_.options.noise) {
    const std::uint64_t image_index =
        exposure.pulse * kMaxCameras + static_cast<std::uint64_t>(exposure.camera);
    shot.noise_seed = static_cast<std::uint32_t>(mixed(rig_.options.seed, image_index)) | 1U;
  }
  // Through the lens of the camera that sees it, into the memory of the one that sends it.
  cameras_[static_cast<std::size_t>(exposure.camera)]->render(
      way, bus, shot, sender.pool().writable(shooting.slot).data());
}

}  // namespace vergence::mock
