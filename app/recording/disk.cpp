#include "app/recording/disk.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

namespace vergence::app {
namespace {

/// What says that it is asked in vain (a pipe, an old file system), not that something is lost.
bool cannot_write_back(int error) noexcept {
  return error == ESPIPE || error == EINVAL || error == ENOSYS;
}

class SystemDisk final : public Disk {
 public:
  [[nodiscard]] int create(const char* path) noexcept override {
    const int fd = ::open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    return fd < 0 ? -errno : fd;
  }
  [[nodiscard]] std::int64_t write(int fd, const iovec* pieces, int count,
                                   std::uint64_t offset) noexcept override {
    for (;;) {
      const ssize_t n = ::pwritev(fd, pieces, count, static_cast<off_t>(offset));
      if (n > 0) return n;
      if (n == 0) return -ENOSPC;
      if (errno != EINTR) return -errno;
    }
  }
  [[nodiscard]] int truncate(int fd, std::uint64_t size) noexcept override {
    return ::ftruncate(fd, static_cast<off_t>(size)) == 0 ? 0 : -errno;
  }
  // Not every file system can: the pages then wait as those of any other file.
  void start_writeback(int fd, std::uint64_t offset, std::uint64_t size) noexcept override {
    (void)::sync_file_range(fd, static_cast<off64_t>(offset), static_cast<off64_t>(size),
                            SYNC_FILE_RANGE_WRITE);
  }
  [[nodiscard]] int finish_writeback(int fd, std::uint64_t offset,
                                     std::uint64_t size) noexcept override {
    const int done = ::sync_file_range(
        fd, static_cast<off64_t>(offset), static_cast<off64_t>(size),
        SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER);
    const int error = done == 0 || cannot_write_back(errno) ? 0 : -errno;
    (void)::posix_fadvise(fd, static_cast<off_t>(offset), static_cast<off_t>(size),
                          POSIX_FADV_DONTNEED);
    return error;
  }
  [[nodiscard]] int synchronise(int fd) noexcept override {
    return ::fdatasync(fd) == 0 || errno == EINVAL ? 0 : -errno;
  }
  void close(int fd) noexcept override { (void)::close(fd); }
  [[nodiscard]] int rename(const char* from, const char* to) noexcept override {
    return std::rename(from, to) == 0 ? 0 : -errno;
  }
  void remove(const char* path) noexcept override { (void)::unlink(path); }
};

}  // namespace

Disk& system_disk() noexcept {
  static SystemDisk disk;
  return disk;
}

}  // namespace vergence::app
