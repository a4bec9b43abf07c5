#include "drivers/v4l2/camera_device.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <exception>
#include <utility>

#include "drivers/clock.hpp"
#include "drivers/v4l2/v4l2.hpp"

namespace vergence::v4l2 {

namespace {

// Longest poll of the capture thread, in milliseconds.
constexpr int kPollLimit = 500;
// Consecutive polls with an error and no frame after which the camera counts as disconnected.
constexpr int kPollErrors = 20;

}  // namespace

CaptureThread::CaptureThread(FrameExchange& exchange)
    : exchange_(exchange), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

void CaptureThread::enqueue_free(CaptureQueue& queue) noexcept {
  with_kernel_ = 0;
  const FrameExchange::Buffers free = exchange_.free_buffers();
  for (const std::uint32_t i : free.list())
    if (queue.enqueue(i) == 0) ++with_kernel_;
}

void CaptureThread::start(CaptureQueue& queue, const Settings& settings, int fd) {
  queue_ = &queue;
  settings_ = &settings;
  fd_ = fd;
  const Duration period =
      settings.camera_rate_hz > 0 ? Duration::seconds(1 / settings.camera_rate_hz) : Duration{};
  counter_.emplace(period);
  raster_.reset();
  if (settings.options.thin > 1) raster_.emplace(Duration::seconds(1 / settings.actual.rate_hz));
  poll_errors_ = 0;
  exposures_.reset({settings.actual.exposure, settings.actual.gain_db});
  last_exposure_ = settings.actual.exposure;
  thread_ = std::thread([this] { capture(); });
}

bool CaptureThread::stop() noexcept {
  if (!thread_.joinable()) return false;
  wake();
  thread_.join();
  return true;
}

void CaptureThread::change_exposure(const ExposureSetting& setting) noexcept {
  (void)exposures_.change(setting, monotonic_now());
}

void CaptureThread::wake() const noexcept {
  const std::uint64_t one = 1;
  (void)!::write(wake_.get(), &one, sizeof one);
}

void CaptureThread::capture() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-v4l2");
  for (;;) {
    if (exchange_.standing() != DeviceStatus::ok) return;
    enqueue_returned();
    // Without a queued buffer the kernel returns immediately.
    pollfd fds[2] = {{with_kernel_ > 0 ? fd_ : -1, POLLIN, 0}, {wake_.get(), POLLIN, 0}};
    (void)::poll(fds, 2, kPollLimit);
    std::uint64_t woken = 0;
    if (fds[1].revents != 0) (void)!::read(wake_.get(), &woken, sizeof woken);
    if (fds[0].revents == 0) continue;
    if (!dequeue_filled()) {
      exchange_.lose(monotonic_now());
      return;
    }
    if (poll_errors_ > 0) {
      pollfd pause{wake_.get(), POLLIN, 0};
      (void)::poll(&pause, 1, poll_errors_);
    }
  }
}

void CaptureThread::enqueue_returned() noexcept {
  const FrameExchange::Buffers returned = exchange_.pop_returned();
  for (const std::uint32_t buffer : returned.list()) give_back(buffer);
}

void CaptureThread::give_back(std::uint32_t buffer) noexcept {
  // An error means that the camera is disconnected; the next poll detects it.
  if (queue_->enqueue(buffer) == 0) ++with_kernel_;
}

/// Returns false if the camera is disconnected.
bool CaptureThread::dequeue_filled() noexcept {
  Filled filled;
  switch (queue_->dequeue(&filled)) {
    case 0:
      poll_errors_ = 0;
      --with_kernel_;
      handle(filled);
      return true;
    case EAGAIN:
      return ++poll_errors_ < kPollErrors;
    case ENODEV:
      exchange_.record_dead_node();
      return false;
    default:  // EIO: the driver's queue is in error until streaming restarts
      return ++poll_errors_ < kPollErrors;
  }
}

void CaptureThread::handle(Filled filled) noexcept {
  const Settings& s = *settings_;
  // Ignores invalid indices from a faulty driver.
  if (filled.index >= exchange_.slots().buffers()) return;
  Frame frame;
  frame.arrival = monotonic_now();
  const ExposureSetting& had = exposures_.at(frame.arrival - s.readout - last_exposure_);
  last_exposure_ = had.exposure;
  frame.exposure = had.exposure;
  frame.gain_db = had.gain_db;
  const StampKind kind = stamp_kind(filled.flags, filled.stamp_ns);
  frame.exposure_start =
      exposure_start(kind, filled.stamp_ns, frame.arrival, frame.exposure, s.readout);
  // Does not underflow: configure() checked that buffers hold `needed` bytes.
  const std::size_t needed = min_frame_bytes(s.format, s.actual.width, s.actual.height, s.stride);
  const bool inside = filled.offset <= exchange_.slots().buffer(filled.index).size() - needed;
  const bool whole = inside && filled.bytes >= needed;
  if (!inside) filled.offset = 0;
  if ((filled.flags & V4L2_BUF_FLAG_ERROR) != 0 || !whole) frame.status = FrameStatus::incomplete;

  SequenceCounter::Step step = counter_->next(filled.sequence, frame.exposure_start);
  if (raster_ && !raster_->keep(frame.exposure_start, &step)) {
    give_back(filled.index);
    return;
  }
  frame.counter = step.counter;
  if (step.missing > 0) exchange_.count_lost(step.missing);
  if (!hand_over(filled, frame)) give_back(filled.index);
}

/// Returns false if no slot was free.
bool CaptureThread::hand_over(const Filled& filled, Frame frame) noexcept {
  enqueue_returned();
  const Slots& slots = exchange_.slots();
  const std::optional<FrameSlot> slot =
      slots.in_place() ? exchange_.hold_buffer(filled.index, filled.offset, with_kernel_)
                       : exchange_.hold_pooled();
  if (!slot) return false;
  frame.slot = *slot;
  if (!slots.in_place()) {
    to_grey(settings_->format, slots.buffer(filled.index).data() + filled.offset, settings_->stride,
            settings_->actual.width, settings_->actual.height, exchange_.writable(*slot).data(),
            FramePool::stride(settings_->actual.width));
    give_back(filled.index);
  }
  exchange_.offer(frame);
  return true;
}

namespace {

// Spread of arrival times, used if they have to serve as stamps.
constexpr Duration kUnstamped = Duration::milliseconds(10);

}  // namespace

V4l2Camera::V4l2Camera(UniqueFd fd, Node node)
    : info_{"v4l2", node.serial, node.card, node.path}, node_(std::move(node)), fd_(std::move(fd)) {
  controls_.add(fd_.get());
}

V4l2Camera::~V4l2Camera() { stop(); }

DeviceStatus V4l2Camera::refuse(DeviceStatus status, std::string message) noexcept {
  last_error_ = std::move(message);
  return status;
}

DeviceStatus V4l2Camera::configure(const CameraConfiguration& requested,
                                   CameraConfiguration* actual) noexcept {
  last_error_.clear();
  if (exchange_.busy()) return DeviceStatus::busy;
  try {
    if (std::string invalid = find_invalid(requested); !invalid.empty())
      return refuse(DeviceStatus::bad_configuration, invalid + " is not a valid configuration");
    if (lost_node_)
      if (const DeviceStatus status = open_again(); status != DeviceStatus::ok) return status;
    const DeviceStatus status = bring_to(requested, false);
    if (status == DeviceStatus::ok) {
      requested_ = requested;
      if (actual != nullptr) *actual = settings_->actual;
    } else if (requested_) {
      const std::string why = last_error_;
      // start() tries once more, from the beginning.
      if (bring_to(*requested_, false) != DeviceStatus::ok) lost_node_ = true;
      last_error_ = why;
    }
    return status;
  } catch (const std::exception& e) {
    lost_node_ = true;
    return refuse(DeviceStatus::failed,
                  std::string("there is not enough memory for its images: ") + e.what());
  }
}

/// `keep_slots` is set for a reconnected camera whose images may be held; layout and size must then
/// be the same.
DeviceStatus V4l2Camera::bring_to(const CameraConfiguration& requested, bool keep_slots) {
  Options options;
  if (!parse_options(requested.options, option_table(), "V4L2 cameras", &options, &last_error_))
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

  // Formats can be changed only while there are no buffers.
  if (queue_) {
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
    return refuse(DeviceStatus::failed,
                  "the camera reconnected with images of another layout; configure it again");
  CaptureQueue queue(fd_.get(), node_.type);
  std::vector<Mapping> mappings;
  if (const int error = queue.request(static_cast<std::uint32_t>(options.buffers), &mappings);
      error != 0) {
    if (error == ENODEV) return refuse(DeviceStatus::disconnected, {});
    if (error == EBUSY)
      return refuse(DeviceStatus::busy, "another program streams from this camera; end it first");
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
    return refuse(DeviceStatus::disconnected,
                  "there is no camera " + node_.found_by + " any more; check its cable");
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
      // The failure of a reconnected camera may be temporary; it is retried.
      if (bring_to(*requested_, true) != DeviceStatus::ok) {
        lost_node_ = true;
        return DeviceStatus::disconnected;
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
  if (error == ENODEV) return DeviceStatus::disconnected;
  if (error == ENOSPC)
    return refuse(DeviceStatus::no_bandwidth,
                  "its bus has no bandwidth for another stream; use a lower rate, a smaller size, "
                  "or a port of another USB controller");
  // EPIPE and ENOLINK mean that links or formats of the sensor's media controller do not match.
  const bool pipeline = error == EPIPE || error == ENOLINK;
  return refuse(DeviceStatus::failed,
                std::string("it does not start to stream: ") + std::strerror(error) +
                    (pipeline ? "; check the media pipeline with media-ctl -p" : ""));
}

/// Ends the thread; afterwards only the owner accesses the camera.
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
  ExposureSetting applied;
  if (const DeviceStatus status = change_exposure(controls_, *settings_, requested, &applied);
      status != DeviceStatus::ok)
    return status;
  // The setting also applies after a reconnect.
  requested_->exposure = applied.exposure;
  requested_->gain_db = applied.gain_db;
  settings_->actual.exposure = applied.exposure;
  settings_->actual.gain_db = applied.gain_db;
  capture_.change_exposure(applied);
  if (actual != nullptr) *actual = applied;
  return DeviceStatus::ok;
}

void V4l2Camera::release(FrameSlot slot) noexcept {
  if (exchange_.release(slot)) capture_.wake();
}

}  // namespace vergence::v4l2
