#include "tests/support/gige_camera.hpp"

#include <arpa/inet.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

#include "drivers/clock.hpp"
#include "tests/support/detail/gige_camera_impl.hpp"

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

GigeCamera::Impl::Impl(const GigeCameraOptions& o)
    : options(o),
      sender(o.address, o.extended_ids, o.seed),
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

GigeCamera::Impl::~Impl() {
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

void GigeCamera::Impl::power(bool on) {
  {
    const std::lock_guard lock(mutex_);
    if (on && !powered_) reset();
    powered_ = on;
    if (!on) acquiring_ = false;
  }
  changed_.notify_all();
}

GigeCamera::GigeCamera(const GigeCameraOptions& options) : impl_(std::make_unique<Impl>(options)) {}
GigeCamera::~GigeCamera() = default;

std::string GigeCamera::address(int k) {
  const auto pid = static_cast<unsigned>(::getpid());
  return "127." + std::to_string(1 + (pid >> 8U) % 250) + "." + std::to_string(pid & 0xFFU) + "." +
         std::to_string(k + 2);
}

void GigeCamera::unplug() { impl_->power(false); }
void GigeCamera::replug() { impl_->power(true); }
void GigeCamera::silence(bool silent) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->silent_ = silent;
}
void GigeCamera::lose_frames(int exposures) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->lose_ += exposures;
}
void GigeCamera::tear_frames(int exposures) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->tear_ += exposures;
}
void GigeCamera::set_loss(double share) { impl_->sender.set_loss(share); }
void GigeCamera::lie_about_size(int width, int height) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->lie_width_ = width;
  impl_->lie_height_ = height;
}
void GigeCamera::pulse(std::uint64_t number, HostStamp when) { impl_->pulse(number, 1, when); }
void GigeCamera::take_control(bool taken) { impl_->take_control(taken); }
GigeCameraReport GigeCamera::report() const {
  GigeCameraReport r;
  impl_->sender.add_to(&r);
  const std::lock_guard lock(impl_->mutex_);
  r.starts = impl_->starts_;
  return r;
}
std::uint32_t GigeCamera::read(std::uint32_t address) const { return impl_->get(address); }
void GigeCamera::write(std::uint32_t address, std::uint32_t value) { impl_->set(address, value); }
std::uint64_t GigeCamera::ticks(HostStamp host) const { return impl_->ticks(host); }
bool GigeCamera::acquiring() const { return impl_->acquiring(); }
const GigeCameraOptions& GigeCamera::options() const { return impl_->options; }

}  // namespace vergence::test
