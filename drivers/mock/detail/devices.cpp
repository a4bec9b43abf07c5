#include "drivers/mock/detail/devices.hpp"

#include <algorithm>
#include <exception>
#include <string>

#include "core/types/bayer.hpp"

namespace vergence::mock {

// ---- camera

MockCamera::MockCamera(RigContext* rig, int k)
    : rig_(rig),
      k_(k),
      info_{"mock", "mock-" + std::to_string(k), "rendered camera", "world"},
      clock_(DeviceOscillator::of(rig->options.seed, k, rig->options.clock_drift_ppm)) {}

DeviceStatus MockCamera::configure(const CameraConfiguration& requested,
                                   CameraConfiguration* actual) noexcept {
  const Intrinsics& lens = rig_->truth->mounted().intrinsics[static_cast<std::size_t>(k_)];
  if (!find_invalid(requested).empty()) return DeviceStatus::bad_configuration;
  if (requested.width != lens.width || requested.height != lens.height)
    return DeviceStatus::unsupported;
  if (stream.streaming() || out_.load() > 0 || (rig_->pulsing.load() && !rig_->options.real_time))
    return DeviceStatus::busy;
  try {
    if (pool_ == nullptr) allocate(lens);
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
  configuration_ = requested;
  exposures_.reset({requested.exposure, requested.gain_db});
  if (actual != nullptr) *actual = requested;
  return DeviceStatus::ok;
}

/// Every configuration has the lens's size: the memory of the first one stays.
void MockCamera::allocate(const Intrinsics& lens) {
  renderer_ = std::make_unique<Renderer>(rig_->truth->shared_world(), vergence::Camera(lens),
                                         rig_->options.pattern);
  if (rig_->options.pattern == Pattern::gbrg && !rig_->options.raw)
    mosaic_.resize(FramePool::stride(lens.width) * static_cast<std::size_t>(lens.height));
  arena_ = std::make_unique<Arena>();
  pool_ = std::make_unique<FramePool>(lens.width, lens.height, MockRig::kSlots, *arena_);
}

DeviceStatus MockCamera::set_exposure(const ExposureSetting& requested,
                                      ExposureSetting* actual) noexcept {
  // Limit in dB.
  constexpr double kMaxGain = 40;
  if (!stream.streaming()) return DeviceStatus::stopped;
  if (requested.exposure <= Duration{} ||
      requested.exposure.to_seconds() * configuration_.rate_hz > 1)
    return DeviceStatus::bad_configuration;
  const ExposureSetting applied{requested.exposure, std::clamp(requested.gain_db, 0.0, kMaxGain)};
  // The next image but one, or later where more are made already.
  constexpr std::uint64_t kLatency = 2;
  const std::uint64_t from = std::max(rig_->looked_at.load() + kLatency, rig_->planned.load());
  // Only the newest past entry is used.
  const std::uint64_t planned = rig_->planned.load();
  const std::uint64_t past = planned > MockRig::kSlots ? planned - MockRig::kSlots : 0;
  try {
    exposures_.change(from, applied, past);
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
  if (actual != nullptr) *actual = applied;
  return DeviceStatus::ok;
}

DeviceStatus MockCamera::start(Notifier* ready) noexcept {
  if (pool_ == nullptr) return DeviceStatus::bad_configuration;
  const bool was = stream.streaming() && !disconnected_;
  const DeviceStatus status = stream.start(ready);
  if (status == DeviceStatus::ok && !was) {
    disconnected_ = false;
    starts_.fetch_add(1, std::memory_order_relaxed);
  }
  return status;
}

DeviceStatus MockCamera::wait(Duration limit, Frame* frame) noexcept {
  if (k_ == 0 && rig_->looking.exchange(false)) rig_->room.signal();
  Delivery<Frame> d;
  const DeviceStatus status = stream.pop(limit, &d);
  if (status == DeviceStatus::ok) {
    if (k_ == 0) {
      rig_->looked_at.store(pulse_of_[d.value.slot].load(std::memory_order_acquire));
      rig_->looking.store(true);
      rig_->unseen.fetch_sub(1);
    }
    *frame = d.value;
    frame->arrival = d.arrival;
    delivered_.fetch_add(1, std::memory_order_relaxed);
    out_.fetch_add(1);
    rig_->room.signal();
  } else if (status == DeviceStatus::disconnected) {
    if (!disconnected_) frame->arrival = d.arrival;
    disconnected_ = true;
  }
  return status;
}

void MockCamera::release(FrameSlot slot) noexcept {
  if (!pool_->release(slot)) return;
  out_.fetch_sub(1);
  rig_->room.signal();
}

void MockCamera::stop() noexcept {
  stream.stop();
  rig_->room.signal();
}

CameraStatistics MockCamera::statistics() const noexcept {
  CameraStatistics s;
  s.delivered = delivered_.load(std::memory_order_relaxed);
  s.underruns = underruns.load(std::memory_order_relaxed);
  s.lost = lost.load(std::memory_order_relaxed);
  s.starts = starts_.load(std::memory_order_relaxed);
  return s;
}

void MockCamera::render(std::span<const Transform> T_camera_enu,
                        std::span<const Transform> T_camera_bus, const RenderRequest& shot,
                        std::uint8_t* out) {
  const auto stride = static_cast<std::ptrdiff_t>(FramePool::stride(pool_->width()));
  renderer_->render(T_camera_enu, shot, mosaic_.empty() ? out : mosaic_.data(), stride,
                    T_camera_bus);
  if (!mosaic_.empty())
    bayer_to_grey(mosaic_.data(), stride, pool_->width(), pool_->height(), out, stride);
}

// ---- INS

MockIns::MockIns(RigContext* rig)
    : rig_(rig),
      clock_(DeviceOscillator::of(rig->options.seed, -1, rig->options.clock_drift_ppm)) {}

DeviceStatus MockIns::configure(double rate_hz, double* actual_hz) noexcept {
  if (!(rate_hz > 0)) return DeviceStatus::bad_configuration;
  if (rate_hz > 400) return DeviceStatus::unsupported;
  if (rig_->pulsing.load()) return DeviceStatus::busy;
  rate_ = rate_hz;
  model_ = std::make_unique<InsModel>(
      InsModelOptions{rig_->options.ideal_ins, mixed(rig_->options.seed, 99), rate_hz},
      *rig_->truth);
  if (actual_hz != nullptr) *actual_hz = rate_hz;
  return DeviceStatus::ok;
}

DeviceStatus MockIns::start(Notifier* ready) noexcept {
  if (model_ == nullptr) return DeviceStatus::bad_configuration;
  return stream.start(ready);
}

DeviceStatus MockIns::wait(Duration limit, InsReading* reading) noexcept {
  Delivery<InsReading> d;
  const DeviceStatus status = stream.pop(limit, &d);
  if (status != DeviceStatus::ok) return status;
  *reading = d.value;
  reading->arrival = d.arrival;
  delivered_.fetch_add(1, std::memory_order_relaxed);
  rig_->room.signal();
  return status;
}

void MockIns::stop() noexcept {
  stream.stop();
  rig_->room.signal();
}

InsStatistics MockIns::statistics() const noexcept {
  InsStatistics s;
  s.delivered = delivered_.load(std::memory_order_relaxed);
  s.lost = lost.load(std::memory_order_relaxed);
  s.overruns = overruns.load(std::memory_order_relaxed);
  s.starts = 1;
  return s;
}

// ---- trigger board

MockTrigger::MockTrigger(RigContext* rig, PulseListener* listener)
    : rig_(rig),
      listener_(listener),
      clock_(DeviceOscillator::of(rig->options.seed, -2, rig->options.clock_drift_ppm)) {}

DeviceStatus MockTrigger::configure(const TriggerConfiguration& requested,
                                    TriggerConfiguration* actual) noexcept {
  if (!(requested.rate_hz > 0) || requested.width <= Duration{} || requested.vary < Duration{})
    return DeviceStatus::bad_configuration;
  if (requested.rate_hz > 200) return DeviceStatus::unsupported;
  const Duration period = Duration::seconds(1 / requested.rate_hz);
  if (requested.vary * 2 > period || requested.width + requested.vary >= period)
    return DeviceStatus::unsupported;
  if (rig_->pulsing.load()) return DeviceStatus::busy;
  configuration_ = requested;
  if (actual != nullptr) *actual = requested;
  return DeviceStatus::ok;
}

DeviceStatus MockTrigger::start(Notifier* ready) noexcept {
  if (!(configuration_.rate_hz > 0)) return DeviceStatus::bad_configuration;
  const bool was = stream.streaming();
  const DeviceStatus status = stream.start(ready);
  if (status != DeviceStatus::ok || (was && !disconnected_)) return status;
  starts_.fetch_add(1, std::memory_order_relaxed);
  disconnected_ = false;
  // The trigger board is back, and its pulses have continued.
  if (was) return status;
  try {
    listener_->begin(configuration_);
  } catch (const std::exception&) {
    stream.stop();
    return DeviceStatus::failed;
  }
  return status;
}

DeviceStatus MockTrigger::wait(Duration limit, Pulse* pulse) noexcept {
  Delivery<BoardReport> d;
  const DeviceStatus status = stream.pop(limit, &d);
  if (status == DeviceStatus::disconnected) {
    if (!disconnected_) pulse->arrival = d.arrival;
    disconnected_ = true;
    rig_->room.signal();
  }
  if (status != DeviceStatus::ok) return status;
  *pulse = d.value.pulse;
  pulse->arrival = d.arrival;
  pulses_.fetch_add(1, std::memory_order_relaxed);
  {
    const std::lock_guard lock(asking_);
    if (!any_)
      // The pause was requested before the first report.
      pause_boot_ = d.value.pulse.boot;
    any_ = true;
    newest_ = d.value.slot;
    boot_ = d.value.pulse.boot;
  }
  rig_->room.signal();
  return status;
}

DeviceStatus MockTrigger::pause(std::uint32_t pulses) noexcept {
  // A report is popped before the third pulse after it at the latest, see Scheduler: the fourth is
  // not made yet, on any run.
  constexpr std::uint64_t kAhead = 4;
  if (!stream.streaming()) return DeviceStatus::stopped;
  if (disconnected_) return DeviceStatus::disconnected;
  const std::lock_guard lock(asking_);
  const bool under_way = pause_end_ > 0 && pause_boot_ == boot_ && newest_ < pause_end_;
  if (pulses == 0 || under_way) return DeviceStatus::ok;
  const std::uint64_t from = any_ ? newest_ + kAhead : kAhead;
  pause_end_ = from + pulses;
  pause_boot_ = boot_;
  listener_->leave_out(from, pulses, boot_);
  return DeviceStatus::ok;
}

void MockTrigger::stop() noexcept {
  stream.stop();
  rig_->room.signal();
  listener_->halt();
}

TriggerStatistics MockTrigger::statistics() const noexcept {
  TriggerStatistics s;
  s.pulses = pulses_.load(std::memory_order_relaxed);
  s.lost = lost.load(std::memory_order_relaxed);
  s.reboots = reboots.load(std::memory_order_relaxed);
  s.overruns = overruns.load(std::memory_order_relaxed);
  s.starts = starts_.load(std::memory_order_relaxed);
  return s;
}

}  // namespace vergence::mock
