#include "app/recording/record_ring.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace vergence::app {
namespace {

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

/// Closed at the end of its scope: mappings keep their memory.
struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

}  // namespace

RecordRing::RecordRing(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  capacity_ = (std::max<std::size_t>(bytes, 1) + page - 1) / page * page;
  const Descriptor memory{::memfd_create("vergence-record", MFD_CLOEXEC)};
  if (memory.fd < 0 || ::ftruncate(memory.fd, static_cast<off_t>(capacity_)) != 0)
    fail("memory for the recording's queue");
  void* both = ::mmap(nullptr, 2 * capacity_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (both == MAP_FAILED) fail("address space for the recording's queue");
  memory_ = static_cast<std::uint8_t*>(both);
  for (std::size_t at : {std::size_t{0}, capacity_})
    if (::mmap(memory_ + at, capacity_, PROT_READ | PROT_WRITE,
               MAP_SHARED | MAP_FIXED | MAP_POPULATE, memory.fd, 0) == MAP_FAILED) {
      const int error = errno;
      ::munmap(memory_, 2 * capacity_);
      errno = error;
      fail("memory for the recording's queue");
    }
}

RecordRing::~RecordRing() { ::munmap(memory_, 2 * capacity_); }

std::span<std::uint8_t> RecordRing::begin(std::size_t size, std::size_t spare) noexcept {
  const Count tail = tail_.load(std::memory_order_relaxed);
  const std::size_t free =
      capacity_ - static_cast<std::size_t>(tail - head_.load(std::memory_order_acquire));
  if (size > free || spare > free - size) return {};
  return {place(tail), size};
}

void RecordRing::commit(std::size_t size) noexcept {
  const Count tail = tail_.load(std::memory_order_relaxed) + size;
  const auto waiting = static_cast<std::size_t>(tail - head_.load(std::memory_order_relaxed));
  if (waiting > high_water_.load(std::memory_order_relaxed))
    high_water_.store(waiting, std::memory_order_relaxed);
  tail_.store(tail, std::memory_order_release);
}

std::span<const std::uint8_t> RecordRing::waiting() const noexcept {
  const Count head = head_.load(std::memory_order_relaxed);
  return {place(head), static_cast<std::size_t>(tail_.load(std::memory_order_acquire) - head)};
}

void RecordRing::release(std::size_t size) noexcept {
  head_.store(head_.load(std::memory_order_relaxed) + size, std::memory_order_release);
}

}  // namespace vergence::app
