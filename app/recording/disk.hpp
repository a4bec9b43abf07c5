#pragma once
#include <sys/uio.h>
#include <cstddef>
#include <cstdint>

namespace vergence::app {

/// What a recording asks of the file system; tests put a disk that is full, gone or slow in its
/// place.
///
/// Threads  One. Memory  None. Errors  Negative errno values; nothing throws.
class Disk {
 public:
  virtual ~Disk() = default;
  /// A new, empty file for writing; one of that name is refused (EEXIST). → descriptor
  [[nodiscard]] virtual int create(const char* path) noexcept = 0;
  /// Some of the pieces at `offset` of the file. → bytes written, more than 0
  [[nodiscard]] virtual std::int64_t write(int fd, const iovec* pieces, int count,
                                           std::uint64_t offset) noexcept = 0;
  [[nodiscard]] virtual int truncate(int fd, std::uint64_t size) noexcept = 0;
  /// Bytes of the file begin their way to the disk.
  virtual void start_writeback(int fd, std::uint64_t offset, std::uint64_t size) noexcept = 0;
  /// Waits until bytes are with the disk, and lets the system forget them: pages that nobody reads
  /// do not push out those that somebody does, and never more wait than the disk takes at once. The
  /// system tells a descriptor of a failed writeback once: synchronise() does not repeat it. → 0
  [[nodiscard]] virtual int finish_writeback(int fd, std::uint64_t offset,
                                             std::uint64_t size) noexcept = 0;
  /// Contents and length are on the disk.
  [[nodiscard]] virtual int synchronise(int fd) noexcept = 0;
  virtual void close(int fd) noexcept = 0;
  [[nodiscard]] virtual int rename(const char* from, const char* to) noexcept = 0;
  virtual void remove(const char* path) noexcept = 0;
};

/// The system's.
[[nodiscard]] Disk& system_disk() noexcept;

}  // namespace vergence::app
