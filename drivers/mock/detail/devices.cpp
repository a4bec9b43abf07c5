#include "drivers/mock/detail/devices.hpp"

#include <exception>
#include <string>

#include "core/types/bayer.hpp"

namespace vergence::mock {

// ---- camera -------------------------------------------------------------------------------------------------------

MockCamera::MockCamera(RigContext* rig, int k)
    : rig_(rig),
      k_(k),
      info_{"mock", "mock-" + std::to_string(k), "rendered camera", "world"},
      clock_(DeviceOscillator::of(rig->options.seed, k, rig->options.clock_drift_ppm)) {}

DeviceStatus MockCamera::configure(const CameraConfiguration& wanted, CameraConfiguration* actual) noexcept {
  const Intrinsics& lens = rig_->truth->mounted().intrinsics[static_cast<std::size_t>(k_)];
  if (!(wanted.rate_hz > 0) || wanted.exposure <= Duration{} || wanted.exposure.to_seconds() * wanted.rate_hz > 1)
    return DeviceStatus::bad_configuration;
  if (wanted.width != lens.width || wanted.height != lens.height) return DeviceStatus::unsupported;
  if (stream.streaming()) return DeviceStatus::busy;
  try {
    arena_ = std::make_unique<Arena>(FramePool::memory_needed(lens.width, lens.height, MockRig::kSlots) + kCacheLine);
    pool_ = std::make_unique<FramePool>(lens.width, lens.height, MockRig::kSlots, *arena_);
    renderer_ = std::make_unique<Renderer>(rig_->truth->shared_world(), vergence::Camera(lens), rig_->options.pattern);
    if (rig_->options.pattern == Pattern::gbrg && !rig_->options.raw)
      mosaic_.resize(FramePool::stride(lens.width) * static_cast<std::size_t>(lens.height));
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
  configuration_ = wanted;
  if (actual != nullptr) *actual = wanted;
  return DeviceStatus::ok;
}

DeviceStatus MockCamera::start(Notifier* ready) noexcept {
  if (pool_ == nullptr) return DeviceStatus::bad_configuration;
  const bool was = stream.streaming() && !gone_;
  const DeviceStatus status = stream.start(ready);
  if (status == DeviceStatus::ok && !was) {
    gone_ = false;
    starts_.fetch_add(1, std::memory_order_relaxed);
  }
  return status;
}

DeviceStatus MockCamera::wait(Duration limit, Frame* frame) noexcept {
  Delivery<Frame> d;
  const DeviceStatus status = stream.take(limit, &d);
  if (status == DeviceStatus::ok) {
    *frame = d.value;
    frame->arrival = d.arrival;
    delivered_.fetch_add(1, std::memory_order_relaxed);
    rig_->room.made();
  } else if (status == DeviceStatus::gone) {
    if (!gone_) frame->arrival = d.arrival;
    gone_ = true;
  }
  return status;
}

void MockCamera::release(FrameSlot slot) noexcept {
  pool_->release(slot);
  rig_->room.made();
}

void MockCamera::stop() noexcept {
  stream.stop();
  rig_->room.made();
}

CameraStatistics MockCamera::statistics() const noexcept {
  CameraStatistics s;
  s.delivered = delivered_.load(std::memory_order_relaxed);
  s.underruns = underruns.load(std::memory_order_relaxed);
  s.lost = lost.load(std::memory_order_relaxed);
  s.starts = starts_.load(std::memory_order_relaxed);
  return s;
}

void MockCamera::take(std::span<const Transform> T_camera_enu, std::span<const Transform> T_camera_bus, const Shot& shot,
                      std::uint8_t* out) {
  const auto stride = static_cast<std::ptrdiff_t>(FramePool::stride(pool_->width()));
  renderer_->render(T_camera_enu, shot, mosaic_.empty() ? out : mosaic_.data(), stride, T_camera_bus);
  if (!mosaic_.empty()) bayer_to_grey(mosaic_.data(), stride, pool_->width(), pool_->height(), out, stride);
}

// ---- INS ----------------------------------------------------------------------------------------------------------

MockIns::MockIns(RigContext* rig) : rig_(rig), clock_(DeviceOscillator::of(rig->options.seed, -1, rig->options.clock_drift_ppm)) {}

DeviceStatus MockIns::configure(double rate_hz, double* actual_hz) noexcept {
  if (!(rate_hz > 0)) return DeviceStatus::bad_configuration;
  if (rate_hz > 400) return DeviceStatus::unsupported;
  rate_ = rate_hz;
  model_ = std::make_unique<InsModel>(InsModelOptions{rig_->options.ideal_ins, mixed(rig_->options.seed, 99), rate_hz}, *rig_->truth);
  if (actual_hz != nullptr) *actual_hz = rate_hz;
  return DeviceStatus::ok;
}

DeviceStatus MockIns::start(Notifier* ready) noexcept {
  if (model_ == nullptr) return DeviceStatus::bad_configuration;
  return stream.start(ready);
}

DeviceStatus MockIns::wait(Duration limit, InsReading* reading) noexcept {
  Delivery<InsReading> d;
  const DeviceStatus status = stream.take(limit, &d);
  if (status != DeviceStatus::ok) return status;
  *reading = d.value;
  reading->arrival = d.arrival;
  delivered_.fetch_add(1, std::memory_order_relaxed);
  rig_->room.made();
  return status;
}

void MockIns::stop() noexcept {
  stream.stop();
  rig_->room.made();
}

InsStatistics MockIns::statistics() const noexcept {
  InsStatistics s;
  s.delivered = delivered_.load(std::memory_order_relaxed);
  s.lost = lost.load(std::memory_order_relaxed);
  s.overruns = overruns.load(std::memory_order_relaxed);
  s.starts = 1;
  return s;
}

// ---- trigger board ------------------------------------------------------------------------------------------------

MockTrigger::MockTrigger(const RigContext& rig, PulseListener* listener)
    : listener_(listener), clock_(DeviceOscillator::of(rig.options.seed, -2, rig.options.clock_drift_ppm)) {}

DeviceStatus MockTrigger::configure(const TriggerConfiguration& wanted, TriggerConfiguration* actual) noexcept {
  if (!(wanted.rate_hz > 0)) return DeviceStatus::bad_configuration;
  if (wanted.rate_hz > 200) return DeviceStatus::unsupported;
  rate_ = wanted.rate_hz;
  if (actual != nullptr) *actual = wanted;
  return DeviceStatus::ok;
}

DeviceStatus MockTrigger::start(Notifier* ready) noexcept {
  if (!(rate_ > 0)) return DeviceStatus::bad_configuration;
  if (stream.streaming()) return DeviceStatus::ok;
  const DeviceStatus status = stream.start(ready);
  if (status != DeviceStatus::ok) return status;
  try {
    listener_->begin(rate_);
  } catch (const std::exception&) {
    stream.stop();
    return DeviceStatus::failed;
  }
  return status;
}

DeviceStatus MockTrigger::wait(Duration limit, Pulse* pulse) noexcept {
  Delivery<Pulse> d;
  const DeviceStatus status = stream.take(limit, &d);
  if (status != DeviceStatus::ok) return status;
  *pulse = d.value;
  pulse->arrival = d.arrival;
  pulses_.fetch_add(1, std::memory_order_relaxed);
  return status;
}

void MockTrigger::stop() noexcept {
  stream.stop();
  listener_->halt();
}

TriggerStatistics MockTrigger::statistics() const noexcept {
  TriggerStatistics s;
  s.pulses = pulses_.load(std::memory_order_relaxed);
  s.overruns = overruns.load(std::memory_order_relaxed);
  s.starts = 1;
  return s;
}

}  // namespace vergence::mock
