#include "app/datasets/detail/byte_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {

FileBytes::FileBytes(const std::filesystem::path& file)
    : path_(file), fd_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (fd_ < 0) refuse(file, 0, std::string("cannot be opened: ") + std::strerror(errno));
  struct stat about {};
  if (::fstat(fd_, &about) != 0 || !S_ISREG(about.st_mode)) {
    ::close(fd_);
    refuse(file, 0, "is no regular file; a bag is expected");
  }
  size_ = static_cast<std::uint64_t>(about.st_size);
}

FileBytes::~FileBytes() { ::close(fd_); }

bool FileBytes::read(std::uint64_t offset, std::span<std::uint8_t> out) const noexcept {
  if (offset > size_ || out.size() > size_ - offset) return false;
  for (std::size_t got = 0; got < out.size();) {
    const ssize_t n =
        ::pread(fd_, out.data() + got, out.size() - got, static_cast<off_t>(offset + got));
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
