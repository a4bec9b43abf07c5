#pragma once
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <thread>

#include "app/recording/mcap_file.hpp"

namespace vergence::test {

/// The system's disk with faults on demand.
/// Threads  The settings: any.
class FaultyDisk final : public app::Disk {
 public:
  std::atomic<std::uint64_t> room{~std::uint64_t{0}};  // bytes of a file; then ENOSPC
  std::atomic<int> error{0};                           // errno of every call from now on; 0: none
  std::atomic<int> stall_ms{0};                        // the next write waits so long
  std::atomic<int> writeback_error{0};                 // errno of the next writeback; 0: none
  std::atomic<std::uint64_t> most{~std::uint64_t{0}};  // bytes that one write takes

  [[nodiscard]] int create(const char* path) noexcept override {
    return error != 0 ? -error : system_.create(path);
  }
  [[nodiscard]] std::int64_t write(int fd, const iovec* pieces, int count,
                                   std::uint64_t offset) noexcept override {
    if (const int ms = stall_ms.exchange(0); ms > 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    if (error != 0) return -error;
    if (offset >= room) return -ENOSPC;
    iovec first = pieces[0];
    const std::uint64_t limit = std::min<std::uint64_t>(room - offset, most);
    if (limit == ~std::uint64_t{0}) return system_.write(fd, pieces, count, offset);
    first.iov_len = std::min<std::size_t>(first.iov_len, limit);
    return system_.write(fd, &first, 1, offset);
  }
  [[nodiscard]] int truncate(int fd, std::uint64_t size) noexcept override {
    return error != 0 ? -error : system_.truncate(fd, size);
  }
  void start_writeback(int, std::uint64_t, std::uint64_t) noexcept override {}
  [[nodiscard]] int finish_writeback(int, std::uint64_t, std::uint64_t) noexcept override {
    return -writeback_error.exchange(0);
  }
  [[nodiscard]] int synchronise(int fd) noexcept override {
    return error != 0 ? -error : system_.synchronise(fd);
  }
  void close(int fd) noexcept override { system_.close(fd); }
  [[nodiscard]] int rename(const char* from, const char* to) noexcept override {
    return error != 0 ? -error : system_.rename(from, to);
  }
  void remove(const char* path) noexcept override {
    if (error == 0) system_.remove(path);
  }

 private:
  app::Disk& system_ = app::system_disk();
};

}  // namespace vergence::test
