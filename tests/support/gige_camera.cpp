#include "tests/support/gige_camera.hpp"

#include <arpa/inet.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <stdexcept>

#include "drivers/clock.hpp"
#include "tests/support/detail/gvcp.hpp"

namespace vergence::test {
namespace {

constexpr std::uint16_t kControlPort = 3956;
int datagram_socket(const char* address) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(kControlPort);
  const int on = 1;
  if (fd >= 0 && ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
      ::inet_pton(AF_INET, address, &own.sin_addr) == 1 &&
      ::bind(fd, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0)
    return fd;
  if (fd >= 0) (void)::close(fd);
  return -1;
}

}  // namespace

GigeCamera::GigeCamera(const GigeCameraOptions& o)
    : options_(o),
      sender_(o.address, o.extended_ids, o.seed),
      memory_(gvcp::kMemory, 0),
      born_(monotonic_now()) {
  control_ = datagram_socket(o.address.c_str());
  if (control_ < 0)
    throw std::runtime_error("simulated camera: " + o.address + " port 3956 is in use");
  broadcast_ = o.discoverable ? datagram_socket("255.255.255.255") : -1;
  wake_ = ::eventfd(0, EFD_CLOEXEC);
  reset();
  answering_ = std::thread([this] { answer(); });
  exposing_ = std::thread([this] { expose(); });
  (void)pthread_setname_np(answering_.native_handle(), "simulator-c");
  (void)pthread_setname_np(exposing_.native_handle(), "simulator-x");
}

GigeCamera::~GigeCamera() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_all();
  const std::uint64_t one = 1;
  (void)!::write(wake_, &one, sizeof one);
  answering_.join();
  exposing_.join();
  for (const int fd : {control_, broadcast_, wake_})
    if (fd >= 0) (void)::close(fd);
}

void GigeCamera::power(bool on) {
  {
    const std::lock_guard lock(mutex_);
    if (on && !powered_) reset();
    powered_ = on;
    if (!on) acquiring_ = false;
  }
  changed_.notify_all();
}

std::string GigeCamera::address(int k) {
  const auto pid = static_cast<unsigned>(::getpid());
  return "127." + std::to_string(1 + (pid >> 8U) % 250) + "." + std::to_string(pid & 0xFFU) + "." +
         std::to_string(k + 2);
}

GigeCameraReport GigeCamera::report() const {
  GigeCameraReport r;
  sender_.add_to(&r);
  r.starts = with_lock([&] { return starts_; });
  return r;
}

std::uint64_t GigeCamera::ticks(HostStamp host) const {
  if (options_.tick_frequency == 0) return 0;
  const double f = static_cast<double>(options_.tick_frequency) * 1e-9;
  const double ns =
      static_cast<double>(host.ns() - born_.ns()) * (1 + options_.clock_drift_ppm * 1e-6);
  return static_cast<std::uint64_t>(
      std::llround((static_cast<double>(options_.clock_offset_ns) + ns) * f));
}

}  // namespace vergence::test
