#include "drivers/v4l2/camera_device.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>
#include <exception>
#include <utility>

#include "drivers/v4l2/v4l2.hpp"

namespace vergence::v4l2 {
namespace {

constexpr Duration kUnstamped =
    Duration::milliseconds(10);  // spread of arrivals where they have to serve as stamps

}  // namespace

V4l2Camera::V4l2Camera(UniqueFd fd, Node node)
    : info_{"v4l2", node.serial, node.card, node.path}, node_(std::move(node)), fd_(std::move(fd)) {
  controls_.add(fd_.get());
}

V4l2Camera::~V4l2Camera() { stop(); }

DeviceStatus V4l2Camera::refuse(DeviceStatus status, std::string sentence) noexcept {
  last_error_ = std::move(sentence);
  return status;
}

DeviceStatus V4l2Camera::configure(const CameraConfiguration& requested,
                                   CameraConfiguration* actual) noexcept {
  last_error_.clear();
  if (exchange_.busy()) return DeviceStatus::busy;
  try {
    if (std::string invalid = find_invalid(requested); !invalid.empty())
      return refuse(DeviceStatus::bad_configuration, invalid + " is no configuration");
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

/// `keep_slots`: of a camera that came back, whose images may be held; their size is the same,
/// their layout must be.
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
    exchange_.install({});
    queue_->free();
    queue_.reset();
  }
  Settings settings;
  if (const DeviceStatus s =
          apply(fd_.get(), node_.type, controls_, requested, options, &settings, &last_error_);
      s != DeviceStatus::ok)
    return s;
  const bool in_place = settings.format.layout == Layout::luma_plane;
  if (keep_slots && !exchange_.slots().fit(in_place, settings.stride))
    return refuse(DeviceStatus::failed, "the camera came back with images of another layout");
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
    if (in_place)
      exchange_.use_buffers(requested.width, requested.height, settings.stride);
    else
      exchange_.use_pool(requested.width, requested.height);
  }
  exchange_.install(std::move(mappings));
  queue_ = queue;
  settings_ = std::move(settings);
  return DeviceStatus::ok;
}

void V4l2Camera::close_node() noexcept {
  exchange_.install({});
  queue_.reset();
  subdevice_.reset();
  fd_.reset();
}

DeviceStatus V4l2Camera::open_again() {
  close_node();
  Node node;
  const DeviceStatus found = find_node(node_.found_by, &fd_, &node);
  if (found == DeviceStatus::no_permission)
    return refuse(found, node_.path + ": no permission; add the user to the group video");
  if (found != DeviceStatus::ok)
    return refuse(DeviceStatus::gone,
                  "there is no camera " + node_.found_by + " any more: check its cable");
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
  if (exchange_.standing() == DeviceStatus::ok) return DeviceStatus::ok;
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
    exchange_.begin(ready, longest_silence(requested_->trigger, settings_->actual.rate_hz));
    capture_.start(*queue_, *settings_, fd_.get());
  } catch (const std::exception& e) {
    exchange_.end();
    (void)queue_->stop();
    return refuse(DeviceStatus::failed, e.what());
  }
  return DeviceStatus::ok;
}

DeviceStatus V4l2Camera::start_streaming() {
  capture_.enqueue_free(*queue_);
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
  if (!capture_.stop()) return;
  if (queue_) (void)queue_->stop();
  if (exchange_.drain()) lost_node_ = true;
}

void V4l2Camera::stop() noexcept {
  exchange_.end();
  end_thread();
}

DeviceStatus V4l2Camera::set_exposure(const ExposureSetting& requested,
                                      ExposureSetting* actual) noexcept {
  const std::lock_guard controlling(controlling_);
  if (const DeviceStatus standing = exchange_.standing(); standing != DeviceStatus::ok)
    return standing;
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
  capture_.change_exposure(taken);
  if (actual != nullptr) *actual = taken;
  return DeviceStatus::ok;
}

void V4l2Camera::release(FrameSlot slot) noexcept {
  if (exchange_.release(slot)) capture_.wake();
}

}  // namespace vergence::v4l2
