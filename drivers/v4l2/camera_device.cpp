#include "drivers/v4l2/camera_device.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <utility>

#include "drivers/clock.hpp"
#include "drivers/v4l2/v4l2.hpp"

namespace vergence::v4l2 {
namespace {

constexpr Duration kUnstamped =
    Duration::milliseconds(10);  // spread of arrivals where they have to serve as stamps

}  // namespace

V4l2Camera::V4l2Camera(UniqueFd fd, Node node)
    : info_{"v4l2", node.serial, node.card, node.path},
      node_(std::move(node)),
      fd_(std::move(fd)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  controls_.add(fd_.get());
}

V4l2Camera::~V4l2Camera() { stop(); }

// ---- the owner's side

DeviceStatus V4l2Camera::refuse(DeviceStatus status, std::string sentence) noexcept {
  last_error_ = std::move(sentence);
  return status;
}

DeviceStatus V4l2Camera::configure(const CameraConfiguration& requested,
                                   CameraConfiguration* actual) noexcept {
  last_error_.clear();
  {
    const std::lock_guard lock(mutex_);
    if (streaming_ || slots_.held() > 0) return DeviceStatus::busy;
  }
  try {
    if (std::string nonsense = find_nonsense(requested); !nonsense.empty())
      return refuse(DeviceStatus::bad_configuration, nonsense + " is no configuration");
    if (lost_node_)
      if (const DeviceStatus status = open_again(); status != DeviceStatus::ok) return status;
    const DeviceStatus status = bring_to(requested, false);
    if (status == DeviceStatus::ok) {
      requested_ = requested;
      if (actual != nullptr) *actual = settings_->actual;
    } else if (requested_) {
      const std::string why = last_error_;
      if (bring_to(*requested_, false) != DeviceStatus::ok)
        lost_node_ = true;  // start() tries once more, from the beginning
      last_error_ = why;
    }
    return status;
  } catch (const std::exception& e) {
    lost_node_ = true;
    return refuse(DeviceStatus::failed,
                  std::string("there is no memory for its images: ") + e.what());
  }
}

/// `keep_slots`: of a camera that came back, whose images may be held; its size is the same.
DeviceStatus V4l2Camera::bring_to(const CameraConfiguration& requested, bool keep_slots) {
  Options options;
  if (!take_options(requested.options, option_table(), "V4L2 cameras", &options, &last_error_))
    return DeviceStatus::unsupported;
  options.trigger_control = key_of(options.trigger_control);
  for (auto& control : options.controls) control.first = key_of(control.first);
  Controls controls;
  if (!options.subdevice.empty()) {
    subdevice_.reset(::open(options.subdevice.c_str(), O_RDWR | O_CLOEXEC));
    if (!subdevice_.valid())
      return refuse(DeviceStatus::unsupported,
                    "option subdevice: " + options.subdevice + ": " + std::strerror(errno));
    controls.add(subdevice_.get());
  }
  controls.add(fd_.get());
  controls_ = std::move(controls);

  if (queue_) {  // formats can be changed only while there are no buffers
    forget_buffers();
    queue_->free();
    queue_.reset();
  }
  Settings settings;
  if (const DeviceStatus s =
          apply(fd_.get(), node_.type, controls_, requested, options, &settings, &last_error_);
      s != DeviceStatus::ok)
    return s;
  CaptureQueue queue(fd_.get(), node_.type);
  std::vector<Mapping> mappings;
  if (const int error = queue.request(static_cast<std::uint32_t>(options.buffers), &mappings);
      error != 0) {
    if (error == ENODEV) return refuse(DeviceStatus::gone, {});
    if (error == EBUSY)
      return refuse(DeviceStatus::busy, "another program streams from this camera: end it first");
    return refuse(DeviceStatus::failed,
                  std::string("the kernel gives no buffers: ") + std::strerror(error));
  }
  if (mappings.size() <= kBufferReserve || mappings.front().bytes() < settings.image_size) {
    queue.free();
    return refuse(DeviceStatus::failed,
                  "the kernel gives " + std::to_string(mappings.size()) + " buffers of " +
                      std::to_string(mappings.front().bytes()) + " bytes, too few or too small");
  }
  stamps_ = stamp_kind(queue.description_flags(), 1);
  if (!keep_slots) {
    if (settings.format.layout == Layout::luma_plane)
      slots_.use_buffers(requested.width, requested.height, settings.stride);
    else
      slots_.use_pool(requested.width, requested.height);
  }
  const std::lock_guard lock(mutex_);
  slots_.install(std::move(mappings));
  queue_ = queue;
  settings_ = std::move(settings);
  return DeviceStatus::ok;
}

void V4l2Camera::forget_buffers() noexcept {
  const std::lock_guard lock(mutex_);
  slots_.install({});
}

void V4l2Camera::close_node() noexcept {
  forget_buffers();
  queue_.reset();
  subdevice_.reset();
  fd_.reset();
}

DeviceStatus V4l2Camera::open_again() {
  close_node();
  Node node;
  const DeviceStatus found = find_node(info_.serial, &fd_, &node);
  if (found == DeviceStatus::no_permission)
    return refuse(found, node_.path + ": no permission; add the user to the group video");
  if (found != DeviceStatus::ok)
    return refuse(DeviceStatus::gone,
                  "there is no camera " + info_.serial + " any more: check its cable");
  node_ = std::move(node);
  info_.place = node_.path;
  lost_node_ = false;
  return DeviceStatus::ok;
}

DeviceTiming V4l2Camera::timing() const noexcept {
  if (!settings_) return {};
  DeviceTiming t{settings_->actual.exposure + settings_->readout};
  if (stamps_ == StampKind::none) t.delay_spread = kUnstamped;
  return t;
}

DeviceStatus V4l2Camera::start(Notifier* ready) noexcept {
  last_error_.clear();
  {
    const std::lock_guard lock(mutex_);
    if (streaming_ && !gone_) return DeviceStatus::ok;
  }
  if (!requested_) return DeviceStatus::bad_configuration;
  try {
    const std::lock_guard controlling(controlling_);
    end_thread();
    if (lost_node_) {
      if (const DeviceStatus status = open_again(); status != DeviceStatus::ok) return status;
      // Whatever keeps a camera that is back from its configuration may pass; it is asked again.
      if (bring_to(*requested_, true) != DeviceStatus::ok) {
        lost_node_ = true;
        return DeviceStatus::gone;
      }
    }
    if (const DeviceStatus status = start_streaming(); status != DeviceStatus::ok) return status;
    notifier_ = ready;
    const Duration period = settings_->camera_rate_hz > 0
                                ? Duration::seconds(1 / settings_->camera_rate_hz)
                                : Duration{};
    counter_.emplace(period);
    raster_.reset();
    if (settings_->options.thin > 1)
      raster_.emplace(Duration::seconds(1 / settings_->actual.rate_hz));
    poll_errors_ = 0;
    exposures_.reset({settings_->actual.exposure, settings_->actual.gain_db});
    exposure_now_ = settings_->actual.exposure;
    {
      const std::lock_guard lock(mutex_);
      streaming_ = true;
      gone_ = node_died_ = false;
      ++statistics_.starts;
    }
    thread_ = std::thread([this] { capture(); });
  } catch (const std::exception& e) {
    {
      const std::lock_guard lock(mutex_);
      streaming_ = false;
    }
    (void)queue_->stop();
    return refuse(DeviceStatus::failed, e.what());
  }
  return DeviceStatus::ok;
}

DeviceStatus V4l2Camera::start_streaming() {
  {
    const std::lock_guard lock(mutex_);
    returned_count_ = 0;
    with_kernel_ = 0;
    for (std::uint32_t i = 0; i < slots_.buffers(); ++i)
      if (slots_.may_enqueue(i) && queue_->enqueue(i) == 0) ++with_kernel_;
  }
  const int error = queue_->start();
  switch (error) {
    case 0:
      return DeviceStatus::ok;
    case ENODEV:
      lost_node_ = true;
      break;
    default:
      break;
  }
  (void)queue_->stop();
  if (error == ENODEV) return DeviceStatus::gone;
  if (error == ENOSPC)
    return refuse(DeviceStatus::no_bandwidth,
                  "its bus has no room for another stream: a lower rate, a smaller size, or a port "
                  "of another USB controller");
  const std::string advice = media_advice(node_.path);
  return refuse(DeviceStatus::failed, std::string("it does not begin to stream: ") +
                                          std::strerror(error) +
                                          (advice.empty() ? "" : "\n" + advice));
}

/// After it the owner alone has the camera.
void V4l2Camera::end_thread() noexcept {
  if (!thread_.joinable()) return;
  wake_capture();
  thread_.join();
  if (queue_) (void)queue_->stop();
  const std::lock_guard lock(mutex_);
  if (node_died_) lost_node_ = true;
  for (; ready_count_ > 0; --ready_count_, ready_first_ = (ready_first_ + 1) % ready_.size())
    (void)slots_.release(ready_[ready_first_].slot);
}

void V4l2Camera::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    streaming_ = false;
    gone_ = false;
  }
  changed_.notify_all();
  end_thread();
}

DeviceStatus V4l2Camera::set_exposure(const ExposureSetting& requested,
                                      ExposureSetting* actual) noexcept {
  const std::lock_guard controlling(controlling_);
  {
    const std::lock_guard lock(mutex_);
    if (!streaming_) return DeviceStatus::stopped;
    if (gone_) return DeviceStatus::gone;
  }
  if (requested.exposure <= Duration{} ||
      requested.exposure.to_seconds() * settings_->actual.rate_hz > 1)
    return DeviceStatus::bad_configuration;
  ExposureSetting taken;
  if (const DeviceStatus status = change_exposure(controls_, *settings_, requested, &taken);
      status != DeviceStatus::ok)
    return status;
  requested_->exposure = taken.exposure;  // also after it was unplugged
  requested_->gain_db = taken.gain_db;
  settings_->actual.exposure = taken.exposure;
  settings_->actual.gain_db = taken.gain_db;
  (void)exposures_.change(taken, monotonic_now());
  if (actual != nullptr) *actual = taken;
  return DeviceStatus::ok;
}

// ---- the consumer's side

DeviceStatus V4l2Camera::wait(Duration limit, Frame* frame) noexcept {
  std::unique_lock lock(mutex_);
  if (!streaming_) return DeviceStatus::stopped;
  const auto something = [this] { return ready_count_ > 0 || gone_ || !streaming_; };
  if (!something() && limit > Duration{})
    (void)changed_.wait_for(lock, std::chrono::nanoseconds(limit.ns()), something);
  if (!streaming_) return DeviceStatus::stopped;
  if (ready_count_ > 0) {
    *frame = ready_[ready_first_];
    ready_first_ = (ready_first_ + 1) % ready_.size();
    --ready_count_;
    ++statistics_.delivered;
    if (frame->status == FrameStatus::torn) ++statistics_.torn;
    return DeviceStatus::ok;
  }
  if (!gone_) return DeviceStatus::timeout;
  frame->arrival = gone_at_;
  return DeviceStatus::gone;
}

void V4l2Camera::release(FrameSlot slot) noexcept {
  {
    const std::lock_guard lock(mutex_);
    const std::optional<std::uint32_t> buffer = slots_.release(slot);
    if (!buffer) return;
    returned_[returned_count_++] = *buffer;  // while stopped start() finds it by itself
  }
  wake_capture();
}

CameraStatistics V4l2Camera::statistics() const noexcept {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace vergence::v4l2
