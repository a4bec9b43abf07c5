#include "drivers/v4l2/capture_thread.hpp"

#include <linux/videodev2.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>

#include "drivers/clock.hpp"

namespace vergence::v4l2 {
namespace {

constexpr int kPollLimit =
    500;  // ms: the longest look of the capture thread; nothing depends on it
constexpr int kPollErrors =
    20;  // looks in a row that end in an error without a frame: nothing comes any more

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
    // Without a buffer of ours the kernel answers at once that there is nothing to wait for.
    pollfd fds[2] = {{with_kernel_ > 0 ? fd_ : -1, POLLIN, 0}, {wake_.get(), POLLIN, 0}};
    (void)::poll(fds, 2, kPollLimit);
    std::uint64_t woken = 0;
    if (fds[1].revents != 0) (void)!::read(wake_.get(), &woken, sizeof woken);
    if (fds[0].revents == 0) continue;
    if (!take_filled()) {
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
  const FrameExchange::Buffers returned = exchange_.take_returned();
  for (const std::uint32_t buffer : returned.list()) give_back(buffer);
}

void CaptureThread::give_back(std::uint32_t buffer) noexcept {
  if (queue_->enqueue(buffer) == 0)
    ++with_kernel_;  // else the camera is gone, which the next look finds
}

/// False: the camera is gone.
bool CaptureThread::take_filled() noexcept {
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
      exchange_.note_dead_node();
      return false;
    default:  // EIO: the driver's queue is in error until streaming restarts
      return ++poll_errors_ < kPollErrors;
  }
}

void CaptureThread::handle(Filled filled) noexcept {
  const Settings& s = *settings_;
  if (filled.index >= exchange_.slots().buffers()) return;  // a driver that invents buffers
  Frame frame;
  frame.arrival = monotonic_now();
  const ExposureSetting& had = exposures_.at(frame.arrival - s.readout - last_exposure_);
  last_exposure_ = had.exposure;
  frame.exposure = had.exposure;
  frame.gain_db = had.gain_db;
  const StampKind kind = stamp_kind(filled.flags, filled.stamp_ns);
  frame.exposure_start =
      exposure_start(kind, filled.stamp_ns, frame.arrival, frame.exposure, s.readout);
  const std::size_t needed = least_frame_bytes(s.format, s.actual.width, s.actual.height, s.stride);
  const bool inside =
      filled.offset <= exchange_.slots().buffer(filled.index).size() -
                           needed;  // buffers hold what is needed: configure() has looked
  const bool whole = inside && filled.bytes >= needed;
  if (!inside) filled.offset = 0;
  if ((filled.flags & V4L2_BUF_FLAG_ERROR) != 0 || !whole) frame.status = FrameStatus::torn;

  SequenceCounter::Step step = counter_->next(filled.sequence, frame.exposure_start);
  if (raster_ && !raster_->keep(frame.exposure_start, &step)) {
    give_back(filled.index);
    return;
  }
  frame.counter = step.counter;
  if (step.missing > 0) exchange_.count_lost(step.missing);
  if (!hand_over(filled, frame)) give_back(filled.index);
}

/// False: no slot was free.
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

}  // namespace vergence::v4l2
