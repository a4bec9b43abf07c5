#include "app/datasets/detail/byte_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>

#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

/// Returns the descriptor of the file; −1 if it cannot be opened. A thread keeps only its last file
/// open, because there may be more files than a process may open.
int opened(std::uint64_t number, const std::filesystem::path& file) noexcept {
  struct Last {
    std::uint64_t number = 0;
    int fd = -1;
    ~Last() {
      if (fd >= 0) ::close(fd);
    }
  };
  thread_local Last last;
  if (last.fd >= 0 && last.number == number) return last.fd;
  if (last.fd >= 0) ::close(last.fd);
  last.number = number;
  return last.fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
}

std::uint64_t next_number() noexcept {
  static std::atomic<std::uint64_t> number{0};
  return number.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

FileBytes::FileBytes(const std::filesystem::path& file) : path_(file), number_(next_number()) {
  const int fd = opened(number_, path_);
  if (fd < 0) refuse(file, 0, std::string("cannot be opened: ") + std::strerror(errno));
  struct stat about {};
  if (::fstat(fd, &about) != 0 || !S_ISREG(about.st_mode))
    refuse(file, 0, "is not a regular file; pass a bag");
  size_ = static_cast<std::uint64_t>(about.st_size);
}

bool FileBytes::read(std::uint64_t offset, std::span<std::uint8_t> out) const noexcept {
  if (offset > size_ || out.size() > size_ - offset) return false;
  const int fd = opened(number_, path_);
  for (std::size_t got = 0; got < out.size();) {
    const ssize_t n =
        ::pread(fd, out.data() + got, out.size() - got, static_cast<off_t>(offset + got));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    got += static_cast<std::size_t>(n);
  }
  return true;
}

bool MemoryBytes::read(std::uint64_t offset, std::span<std::uint8_t> out) const noexcept {
  if (offset > bytes_.size() || out.size() > bytes_.size() - offset) return false;
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
  return true;
}

}  // namespace vergence::app::detail
