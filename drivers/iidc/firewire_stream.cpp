#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <exception>
#include <thread>

#include "drivers/clock.hpp"
#include "drivers/iidc/firewire_bus.hpp"

/// The thread that takes images from the ring of an IEEE 1394 camera.
namespace vergence::iidc {
namespace {

constexpr int kLookMs = 100;  // a thread that polls looks up at least so often

std::int64_t realtime_us() noexcept {
  timespec t{};
  (void)::clock_gettime(CLOCK_REALTIME, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000 + t.tv_nsec / 1000;
}

}  // namespace

DeviceStatus FirewireBus::start(StreamSink* sink) noexcept {
  stop();
  if (camera_ == nullptr) return DeviceStatus::gone;
  try {
    if (wake_ < 0) wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (captured_ && kept_in(generation_.load(std::memory_order_relaxed)) == 0) tear_down();
    if (captured_) {
      resume();
    } else if (const DeviceStatus status = set_up(); status != DeviceStatus::ok) {
      return status;
    }
    sink_ = sink;
    stopping_.store(false, std::memory_order_release);
    thread_ = std::thread([this] { stream(); });
    return DeviceStatus::ok;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

/// Goes on with a ring of which images are still held: what came meanwhile goes back.
void FirewireBus::resume() noexcept {
  enqueue_returned();
  for (std::size_t i = 0; i < kMaxBuffers; ++i) {
    dc1394video_frame_t* frame = nullptr;
    if (dc1394_capture_dequeue(camera_, DC1394_CAPTURE_POLICY_POLL, &frame) != DC1394_SUCCESS ||
        frame == nullptr || queued_ == 0)
      return;
    const std::size_t buffer = queue_[queue_first_];
    queue_first_ = (queue_first_ + 1) % queue_.size();
    --queued_;
    enqueue(buffer);
  }
}

void FirewireBus::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) {
    (void)!::write(wake_, "\1\0\0\0\0\0\0", 8);
    thread_.join();
  }
  sink_ = nullptr;
  if (lost_.load(std::memory_order_acquire)) {
    abandon();
  } else if (captured_ && kept_in(generation_.load(std::memory_order_relaxed)) == 0) {
    tear_down();
  }
  drop_orphan();
}

void FirewireBus::stream() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-iidc13");
  const int fd = dc1394_capture_get_fileno(camera_);
  while (!stopping_.load(std::memory_order_acquire)) {
    std::array<pollfd, 2> fds{pollfd{fd, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    if (::poll(fds.data(), fds.size(), kLookMs) < 0 && errno != EINTR) break;
    if (fds[1].revents != 0) {
      std::uint64_t rung = 0;
      (void)!::read(wake_, &rung, sizeof rung);
    }
    enqueue_returned();
    if (fds[0].revents != 0 && !take_one()) break;
  }
  if (stopping_.load(std::memory_order_acquire)) return;
  lost_.store(true, std::memory_order_release);
  sink_->gone(monotonic_now());
}

/// False: the device is gone.
bool FirewireBus::take_one() noexcept {
  dc1394video_frame_t* frame = nullptr;
  if (dc1394_capture_dequeue(camera_, DC1394_CAPTURE_POLICY_POLL, &frame) != DC1394_SUCCESS)
    return false;
  if (frame == nullptr) return true;  // a bus reset, or nothing
  if (queued_ == 0) return true;      // cannot be: the kernel filled what it did not have
  const std::size_t buffer = queue_[queue_first_];
  queue_first_ = (queue_first_ + 1) % queue_.size();
  --queued_;
  Arrival a;
  a.slot = slot_of(buffer);
  a.data = bytes(a.slot);
  a.bytes = shape_.frame_bytes;
  a.at = monotonic_now();
  a.broken = frame->total_bytes != shape_.frame_bytes;
  a.spare = queued_ >= kReserve;
  if (frame->timestamp != 0) {
    a.has_bus_stamp = true;
    a.bus_stamp =
        a.at - Duration::microseconds(realtime_us() - static_cast<std::int64_t>(frame->timestamp));
  }
  kept_.put(a.slot);
  if (!sink_->frame(a)) {
    (void)kept_.remove(a.slot);
    enqueue(buffer);
  }
  return true;
}

}  // namespace vergence::iidc
