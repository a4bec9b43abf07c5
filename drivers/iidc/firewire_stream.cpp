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

/// Thread that pops images from the ring of an IEEE 1394 camera.
namespace vergence::iidc {
namespace {

// Longest poll of the stream's thread, in milliseconds.
constexpr int kPollMs = 100;

std::int64_t realtime_us() noexcept {
  timespec t{};
  (void)::clock_gettime(CLOCK_REALTIME, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000 + t.tv_nsec / 1000;
}

}  // namespace

DeviceStatus FirewireBus::start(StreamSink* sink) noexcept {
  stop();
  if (camera_ == nullptr) return DeviceStatus::disconnected;
  try {
    if (wake_ < 0) wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (!ring_.any_kept()) end_ring();
    if (ring_.captured()) {
      ring_.resume();
    } else if (const DeviceStatus status = ring_.set_up(camera_, node_.device, &last_error_);
               status != DeviceStatus::ok) {
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

void FirewireBus::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) {
    (void)!::write(wake_, "\1\0\0\0\0\0\0", 8);
    thread_.join();
  }
  sink_ = nullptr;
  if (lost_.load(std::memory_order_acquire) || !ring_.any_kept()) end_ring();
  ring_.drop_orphans();
}

void FirewireBus::stream() noexcept {
  (void)pthread_setname_np(pthread_self(), "vergence-iidc13");
  const int fd = ring_.descriptor();
  while (!stopping_.load(std::memory_order_acquire)) {
    std::array<pollfd, 2> fds{pollfd{fd, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    if (::poll(fds.data(), fds.size(), kPollMs) < 0 && errno != EINTR) break;
    if (fds[1].revents != 0) {
      std::uint64_t rung = 0;
      (void)!::read(wake_, &rung, sizeof rung);
    }
    ring_.enqueue_returned();
    if (fds[0].revents != 0 && !read_event()) break;
  }
  if (stopping_.load(std::memory_order_acquire)) return;
  lost_.store(true, std::memory_order_release);
  sink_->disconnected(monotonic_now());
}

/// Returns false if the device is disconnected.
bool FirewireBus::read_event() noexcept {
  FirewireRing::Filled filled;
  switch (ring_.pop(&filled)) {
    case FirewireRing::PopResult::disconnected:
      return false;
    case FirewireRing::PopResult::empty:
      return true;
    case FirewireRing::PopResult::filled:
      break;
  }
  Arrival a;
  a.slot = filled.slot;
  a.data = ring_.bytes(a.slot);
  a.bytes = ring_.shape().frame_bytes;
  a.at = monotonic_now();
  a.broken = filled.broken;
  a.spare = filled.spare;
  if (filled.at_us != 0) {
    a.has_bus_stamp = true;
    a.bus_stamp =
        a.at - Duration::microseconds(realtime_us() - static_cast<std::int64_t>(filled.at_us));
  }
  if (!sink_->frame(a)) ring_.refuse(a.slot);
  return true;
}

}  // namespace vergence::iidc
