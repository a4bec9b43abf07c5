#include <linux/videodev2.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <cerrno>

#include "drivers/clock.hpp"
#include "drivers/v4l2/camera_device.hpp"

/// What V4l2Camera does on its capture thread.
namespace vergence::v4l2 {
namespace {

constexpr int kPollLimit =
    500;  // ms: the longest look of the capture thread; nothing depends on it
constexpr int kPollErrors =
    20;  // looks in a row that end in an error without a frame: nothing comes any more

}  // namespace

void V4l2Camera::wake_capture() const noexcept {
  const std::uint64_t one = 1;
  (void)!::write(wake_.get(), &one, sizeof one);
}

void V4l2Camera::capture() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-v4l2");
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (!streaming_) return;
    }
    enqueue_returned();
    // Without a buffer of ours the kernel answers at once that there is nothing to wait for.
    pollfd fds[2] = {{with_kernel_ > 0 ? fd_.get() : -1, POLLIN, 0}, {wake_.get(), POLLIN, 0}};
    (void)::poll(fds, 2, kPollLimit);
    std::uint64_t woken = 0;
    if (fds[1].revents != 0) (void)!::read(wake_.get(), &woken, sizeof woken);
    if (fds[0].revents == 0) continue;
    if (!take_filled()) {
      leave();
      return;
    }
    if (poll_errors_ > 0) {
      pollfd pause{wake_.get(), POLLIN, 0};
      (void)::poll(&pause, 1, poll_errors_);
    }
  }
}

void V4l2Camera::enqueue_returned() noexcept {
  std::array<std::uint32_t, Slots::kMost> list{};
  std::size_t count = 0;
  {
    const std::lock_guard lock(mutex_);
    std::swap(count, returned_count_);
    list = returned_;
  }
  for (std::size_t i = 0; i < count; ++i) give_back(list[i]);
}

void V4l2Camera::give_back(std::uint32_t buffer) noexcept {
  if (queue_->enqueue(buffer) == 0)
    ++with_kernel_;  // else the camera is gone, which the next look finds
}

/// False: the camera is gone.
bool V4l2Camera::take_filled() noexcept {
  Filled filled;
  switch (queue_->dequeue(&filled)) {
    case 0:
      poll_errors_ = 0;
      --with_kernel_;
      handle(filled);
      return true;
    case EAGAIN:
      return ++poll_errors_ < kPollErrors;
    case ENODEV: {
      const std::lock_guard lock(mutex_);
      node_died_ = true;
      return false;
    }
    default:  // EIO: the driver's queue is in error until streaming restarts
      return ++poll_errors_ < kPollErrors;
  }
}

void V4l2Camera::handle(Filled filled) noexcept {
  const Settings& s = *settings_;
  if (filled.index >= slots_.buffers()) return;  // a driver that invents buffers
  Frame frame;
  frame.arrival = monotonic_now();
  const ExposureSetting& had = exposures_.at(frame.arrival - s.readout - exposure_now_);
  exposure_now_ = had.exposure;
  frame.exposure = had.exposure;
  frame.gain_db = had.gain_db;
  const StampKind kind = stamp_kind(filled.flags, filled.stamp_ns);
  frame.exposure_start =
      exposure_start(kind, filled.stamp_ns, frame.arrival, frame.exposure, s.readout);
  const std::size_t needed = least_frame_bytes(s.format, s.actual.width, s.actual.height, s.stride);
  const bool inside =
      filled.offset <= slots_.buffer(filled.index).size() -
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
  if (step.missing > 0) {
    const std::lock_guard lock(mutex_);
    statistics_.lost += step.missing;
  }
  if (hand_over(filled, frame)) {
    changed_.notify_one();
    if (notifier_ != nullptr) notifier_->notify();
  }
}

/// False: no slot was free.
bool V4l2Camera::hand_over(const Filled& filled, Frame frame) noexcept {
  enqueue_returned();
  std::unique_lock lock(mutex_);
  if (slots_.in_place()) {
    if (with_kernel_ < kBufferReserve) {
      ++statistics_.underruns;
      lock.unlock();
      give_back(filled.index);
      return false;
    }
    frame.slot = slots_.hold_buffer(filled.index, filled.offset);
  } else {
    const std::optional<FrameSlot> slot = slots_.hold_pooled();
    if (!slot) {
      ++statistics_.underruns;
      lock.unlock();
      give_back(filled.index);
      return false;
    }
    frame.slot = *slot;
    lock.unlock();
    to_grey(settings_->format, slots_.buffer(filled.index).data() + filled.offset,
            settings_->stride, settings_->actual.width, settings_->actual.height,
            slots_.writable(*slot).data(), FramePool::stride(settings_->actual.width));
    give_back(filled.index);
    lock.lock();
  }
  ready_[(ready_first_ + ready_count_) % ready_.size()] = frame;
  ++ready_count_;
  return true;
}

void V4l2Camera::leave() noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (!streaming_) return;
    gone_ = true;
    gone_at_ = monotonic_now();
  }
  changed_.notify_all();
  if (notifier_ != nullptr) notifier_->notify();
}

}  // namespace vergence::v4l2
