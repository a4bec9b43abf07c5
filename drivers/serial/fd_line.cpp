#include "drivers/serial/detail/fd_line.hpp"

#include <errno.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "drivers/clock.hpp"

namespace vergence {
namespace {

/// Time left until `deadline`, for ppoll(); zero if it has passed.
timespec left_until(HostStamp deadline) noexcept {
  const std::int64_t ns = std::max<std::int64_t>(0, (deadline - monotonic_now()).ns());
  return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}

}  // namespace

FdLine::FdLine(UniqueFd tty, UniqueFd wake, const LineSettings& settings) noexcept
    : tty_(std::move(tty)), wake_(std::move(wake)), settings_(settings) {}

FdLine::~FdLine() {
  // Otherwise close() waits up to half a minute for a device that accepts no bytes.
  (void)::tcflush(tty_.get(), TCIOFLUSH);
}

LineRead FdLine::read(std::span<std::uint8_t> out, Duration limit) noexcept {
  const HostStamp deadline = monotonic_now() + limit;
  // Ends: each round without data is an interruption, limited by the deadline.
  for (;;) {
    std::array<pollfd, 2> fds{{{tty_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}}};
    const timespec left = left_until(deadline);
    const int n = ::ppoll(fds.data(), fds.size(), &left, nullptr);
    if (n < 0 && errno != EINTR) return {DeviceStatus::failed, 0, monotonic_now()};
    if (n == 0) return {DeviceStatus::timeout, 0, {}};
    if (n > 0 && (fds[1].revents & POLLIN) != 0) {
      std::uint64_t count = 0;
      (void)!::read(wake_.get(), &count, sizeof count);
      return {DeviceStatus::stopped, 0, {}};
    }
    if (n > 0 && fds[0].revents != 0) {
      const ssize_t got = ::read(tty_.get(), out.data(), out.size());
      // Taken after the read; otherwise bytes received during it would seem to arrive before they
      // were sent.
      const HostStamp arrival = monotonic_now();
      if (got > 0) return {DeviceStatus::ok, static_cast<std::size_t>(got), arrival};
      const bool nothing_yet =
          got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
      // Readiness without data is a hang-up: the converter is disconnected.
      if (!nothing_yet || (fds[0].revents & (POLLHUP | POLLERR | POLLNVAL)) != 0)
        return {DeviceStatus::disconnected, 0, arrival};
    }
    if (monotonic_now() >= deadline) return {DeviceStatus::timeout, 0, {}};
  }
}

DeviceStatus FdLine::write(std::span<const std::uint8_t> bytes, Duration limit) noexcept {
  const HostStamp deadline = monotonic_now() + limit;
  // Ends: every round writes, or is limited by the deadline.
  while (!bytes.empty()) {
    const ssize_t put = ::write(tty_.get(), bytes.data(), bytes.size());
    if (put > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
      continue;
    }
    if (put < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)
      return DeviceStatus::disconnected;
    pollfd p{tty_.get(), POLLOUT, 0};
    const timespec left = left_until(deadline);
    const int n = ::ppoll(&p, 1, &left, nullptr);
    if (n < 0 && errno != EINTR) return DeviceStatus::failed;
    if (n > 0 && (p.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0)
      return DeviceStatus::disconnected;
    if (monotonic_now() >= deadline) return DeviceStatus::timeout;
  }
  return DeviceStatus::ok;
}

DeviceStatus FdLine::set_baud(std::uint32_t baud) noexcept {
  LineSettings requested = settings_;
  requested.baud = baud;
  discard_input();
  const DeviceStatus status = set_raw_tty(tty_.get(), requested);
  if (status == DeviceStatus::ok) settings_ = requested;
  discard_input();
  return status;
}

void FdLine::discard_input() noexcept { (void)::tcflush(tty_.get(), TCIFLUSH); }

void FdLine::wake() noexcept {
  const std::uint64_t one = 1;
  (void)!::write(wake_.get(), &one, sizeof one);
}

HostStamp FdLine::now() const noexcept { return monotonic_now(); }

}  // namespace vergence
