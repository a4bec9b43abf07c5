#include "drivers/iidc/iidc_camera.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "drivers/clock.hpp"

namespace vergence::iidc {
IidcCamera::IidcCamera(std::unique_ptr<CameraBus> bus, const ConfigRom& rom,
                       std::shared_ptr<SharedClock> clock, Duration patience)
    : bus_(std::move(bus)),
      clock_(clock != nullptr ? std::move(clock) : std::make_shared<SharedClock>()),
      registers_(bus_.get(), rom.command_base, patience) {}

IidcCamera::~IidcCamera() { stop(); }

DeviceStatus IidcCamera::refused(DeviceStatus status, std::string why) {
  last_error_ = std::move(why);
  return status;
}

// ---- the owner's thread

DeviceStatus IidcCamera::configure(const CameraConfiguration& requested,
                                   CameraConfiguration* actual) noexcept {
  try {
    return configure_or_throw(requested, actual);
    // Out of memory for slots or a message.
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

DeviceStatus IidcCamera::configure_or_throw(const CameraConfiguration& requested,
                                            CameraConfiguration* actual) {
  if (queue_.started()) return refused(DeviceStatus::busy, "it is streaming; stop it first");
  if (queue_.held() != 0)
    return refused(DeviceStatus::busy, "its images are still in use; release them first");
  drain();
  CameraPlan plan;
  std::string why;
  DeviceStatus status = make_plan(&registers_, bus_->traits(), requested, &plan, &why);
  if (status == DeviceStatus::ok) status = apply_plan(&registers_, bus_->traits(), &plan, &why);
  if (status == DeviceStatus::ok && (!configured_ || !(plan.shape == plan_.shape))) {
    configured_ = false;
    status = bus_->allocate(plan.shape);
    why = bus_->last_error();
  }
  if (status != DeviceStatus::ok) return refused(status, std::move(why));
  if (!plan.grey.none())
    converted_.allocate(plan.options.buffers, FramePool::stride(plan.size.width) *
                                                  static_cast<std::size_t>(plan.size.height));
  plan_ = plan;
  configured_ = true;
  last_error_.clear();
  if (actual != nullptr) {
    CameraConfiguration done = requested;
    done.rate_hz = plan.rate_hz;
    done.exposure = plan.exposure;
    done.gain_db = plan.gain_db;
    done.pixel_format = to_string(plan.coding);
    *actual = done;
  }
  return DeviceStatus::ok;
}

/// On 1394 one packet per cycle; on USB the speed of the wire at best.
Duration IidcCamera::transfer_time() const noexcept {
  const BusTraits& bus = bus_->traits();
  if (bus.isochronous)
    return Duration::seconds(
        static_cast<double>(packets_for(plan_.shape.frame_bytes, plan_.shape.packet_bytes)) /
        kCyclesPerSecond);
  return Duration::seconds(static_cast<double>(plan_.shape.image_bytes) / bus.bytes_per_second);
}

DeviceTiming IidcCamera::timing() const noexcept {
  DeviceTiming t;
  const BusTraits& bus = bus_->traits();
  t.min_delay = plan_.exposure + transfer_time();
  const bool stamped = plan_.info.has(FrameInfoItem::time);
  t.resolution = stamped ? Duration::nanoseconds(kCycleNs / kTicksPerCycle + 1)
                         : Duration::nanoseconds(kCycleNs);
  // The arrival serves as stamp.
  if (!stamped && !bus.isochronous) {
    t.min_delay = plan_.exposure;
    t.resolution = Duration::milliseconds(1);
  }
  return t;
}

DeviceStatus IidcCamera::start(Notifier* ready) noexcept {
  if (!configured_) return DeviceStatus::bad_configuration;
  const bool again = queue_.started();
  if (again && !lost_.load(std::memory_order_acquire)) return DeviceStatus::ok;
  const std::lock_guard lock(asking_);
  bus_->stop();
  try {
    const DeviceStatus status = begin(ready);
    if (status == DeviceStatus::ok) return status;
    if (!lost_.load(std::memory_order_acquire)) {
      registers_.transmit(false);
      (void)registers_.pop_status();
    }
    bus_->stop();
    // Remains disconnected until the camera reconnects or stop() is called.
    if (again) {
      lost_.store(true, std::memory_order_release);
      queue_.fail();
    } else {
      queue_.end();
    }
    return status;
  } catch (const std::exception&) {
    if (again) lost_.store(true, std::memory_order_release);
    return DeviceStatus::failed;
  }
}

DeviceStatus IidcCamera::begin(Notifier* ready) {
  std::string why;
  if (lost_.load(std::memory_order_acquire)) {
    const DeviceStatus back = bus_->reopen();
    if (back != DeviceStatus::ok) return refused(DeviceStatus::disconnected, bus_->last_error());
    lost_.store(false, std::memory_order_release);
  }
  CameraPlan plan = plan_;
  DeviceStatus status = apply_plan(&registers_, bus_->traits(), &plan, &why);
  // The camera was disconnected while stopped.
  if (status == DeviceStatus::disconnected) lost_.store(true, std::memory_order_release);
  if (status == DeviceStatus::timeout || status == DeviceStatus::failed ||
      status == DeviceStatus::unsupported) {
    lost_.store(true, std::memory_order_release);
    // The camera no longer responds as before; the next start() opens it again.
    status = DeviceStatus::disconnected;
  }
  if (status == DeviceStatus::ok && !(plan.shape == plan_.shape)) {
    why = "the camera's frames are not those it was configured for; configure it again";
    status = DeviceStatus::bad_configuration;
  }
  if (status != DeviceStatus::ok) return refused(status, std::move(why));
  // Assigns field by field, because a consumer may be viewing an earlier image by plan_.size.
  plan_.exposure = plan.exposure;
  plan_.gain_db = plan.gain_db;
  plan_.rate_hz = plan.rate_hz;
  plan_.info = plan.info;
  drain();
  reader_.begin(plan_, bus_->traits().isochronous, clock_.get());
  exposures_.reset({plan_.exposure, plan_.gain_db});
  exposure_now_ = plan_.exposure;
  transfer_ = transfer_time();
  strays_ = 0;
  queue_.begin(ready, longest_silence(plan_.trigger, plan_.rate_hz));
  status = bus_->start(this);
  if (status == DeviceStatus::ok) {
    registers_.transmit(true);
    status = registers_.pop_status();
    if (status != DeviceStatus::ok) why = registers_.last_error();
    if (status == DeviceStatus::timeout || status == DeviceStatus::unsupported)
      status = DeviceStatus::disconnected;
  } else {
    why = bus_->last_error();
  }
  if (status != DeviceStatus::ok) {
    if (status == DeviceStatus::disconnected) lost_.store(true, std::memory_order_release);
    return refused(status, std::move(why));
  }
  queue_.count_start();
  last_error_.clear();
  return DeviceStatus::ok;
}

void IidcCamera::stop() noexcept {
  const bool was = queue_.started();
  queue_.end();
  if (!was) return;
  // libdc1394 permits no register access while a capture ends.
  const std::lock_guard lock(asking_);
  if (!lost_.load(std::memory_order_acquire)) {
    registers_.transmit(false);
    if (registers_.pop_status() == DeviceStatus::disconnected)
      lost_.store(true, std::memory_order_release);
  }
  bus_->stop();
}

DeviceStatus IidcCamera::standing() const noexcept {
  if (!queue_.started()) return DeviceStatus::stopped;
  return lost_.load(std::memory_order_acquire) ? DeviceStatus::disconnected : DeviceStatus::ok;
}

DeviceStatus IidcCamera::trigger_once() noexcept {
  if (!configured_ || plan_.trigger != CameraTrigger::software) return DeviceStatus::unsupported;
  const std::lock_guard lock(asking_);
  if (const DeviceStatus s = standing(); s != DeviceStatus::ok) return s;
  registers_.software_trigger();
  const DeviceStatus status = registers_.pop_status();
  if (status == DeviceStatus::ok) return status;
  try {
    last_error_ = registers_.last_error();
  } catch (const std::exception&) {
    last_error_.clear();
  }
  return status;
}

DeviceStatus IidcCamera::set_exposure(const ExposureSetting& requested,
                                      ExposureSetting* actual) noexcept {
  const std::lock_guard lock(asking_);
  if (const DeviceStatus s = standing(); s != DeviceStatus::ok) return s;
  if (requested.exposure <= Duration{} || requested.exposure.to_seconds() * plan_.rate_hz > 1)
    return DeviceStatus::bad_configuration;
  const auto nearest = [](const AbsoluteRange& r, double value) {
    return std::clamp(value, r.least, std::max(r.least, r.most));
  };
  ExposureSetting applied{plan_.exposure, plan_.gain_db};
  if (const AbsoluteRange r = registers_.absolute_range(Feature::shutter); r.present)
    applied.exposure = Duration::seconds(
        registers_.set_absolute(Feature::shutter, nearest(r, requested.exposure.to_seconds())));
  if (const AbsoluteRange r = registers_.absolute_range(Feature::gain); r.present)
    applied.gain_db = registers_.set_absolute(Feature::gain, nearest(r, requested.gain_db));
  const DeviceStatus status = registers_.pop_status();
  if (status != DeviceStatus::ok)
    return status == DeviceStatus::disconnected ? status : DeviceStatus::failed;
  // The setting also applies after a stop or a reconnect.
  plan_.exposure = applied.exposure;
  plan_.gain_db = applied.gain_db;
  (void)exposures_.change(applied, monotonic_now());
  if (actual != nullptr) *actual = applied;
  return DeviceStatus::ok;
}

std::string IidcCamera::remark() const {
  if (!configured_ || plan_.info.has(FrameInfoItem::counter)) return {};
  return "it embeds no counter and no stamp, so lost images are detected by their times only";
}

// ---- the stream's thread

bool IidcCamera::frame(const Arrival& arrival) noexcept {
  // No frame follows a disconnect.
  if (lost_.load(std::memory_order_acquire)) return false;
  const ExposureSetting& had = exposures_.at(arrival.at - transfer_ - exposure_now_);
  exposure_now_ = had.exposure;
  reader_.set_exposure(had.exposure);
  const ReadFrame read = reader_.read(arrival);
  if (!read.accepted) {
    if (read.stray && ++strays_ == kStrays) disconnected(arrival.at);
    return false;
  }
  strays_ = 0;
  if (read.missing > 0) queue_.count_lost(read.missing);
  Frame frame{arrival.slot, read.counter, read.exposure_start, arrival.at,
              had.exposure, read.status,  had.gain_db};
  const bool convert = !plan_.grey.none();
  if (convert) {
    const auto slot = converted_.acquire();
    if (!slot) {
      queue_.count_underrun();
      return false;
    }
    frame.slot = *slot;
    if (read.status == FrameStatus::complete)
      to_grey(plan_.grey, arrival.data, plan_.size.width, plan_.size.height,
              converted_.bytes(*slot), FramePool::stride(plan_.size.width));
  } else if (!arrival.spare) {
    queue_.count_underrun();
    return false;
  }
  const bool offered = queue_.offer(frame);
  // The stream was stopped meanwhile.
  if (!offered && convert) converted_.release(frame.slot);
  return offered && !convert;
}

void IidcCamera::disconnected(HostStamp at) noexcept {
  if (lost_.exchange(true, std::memory_order_acq_rel)) return;
  queue_.lose(at);
}

// ---- the consumer's thread

DeviceStatus IidcCamera::wait(Duration limit, Frame* frame) noexcept {
  const DeviceStatus status = queue_.wait(limit, frame);
  // The camera is silent.
  if (status == DeviceStatus::disconnected) lost_.store(true, std::memory_order_release);
  return status;
}

ImageView IidcCamera::view(FrameSlot slot) const noexcept {
  const int width = plan_.size.width, height = plan_.size.height;
  if (plan_.grey.none()) return {bus_->bytes(slot), width, height, width};
  return {converted_.bytes(slot), width, height,
          static_cast<std::ptrdiff_t>(FramePool::stride(width))};
}

void IidcCamera::return_slot(FrameSlot slot) noexcept {
  if (plan_.grey.none()) {
    bus_->give_back(slot);
  } else {
    converted_.release(slot);
  }
}

void IidcCamera::release(FrameSlot slot) noexcept {
  if (queue_.release(slot)) return_slot(slot);
}

/// Discards frames between stream and consumer. Precondition: the stream is stopped.
void IidcCamera::drain() noexcept {
  for (FrameSlot slot = 0; queue_.drain(&slot);) return_slot(slot);
}

}  // namespace vergence::iidc
