#pragma once
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <thread>

namespace vergence::test {

/// A file whose disk stands still: who writes to it waits until take_all().
class StandingFile {
 public:
  explicit StandingFile(const std::filesystem::path& name) {
    if (::mkfifo(name.c_str(), 0644) != 0) return;
    fd_ = ::open(name.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    const int full = ::open(name.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    while (::write(full, "\n", 1) == 1) {
    }
    (void)::close(full);
  }
  ~StandingFile() {
    if (taking_.joinable()) taking_.join();
    (void)::close(fd_);
  }
  StandingFile(const StandingFile&) = delete;
  StandingFile& operator=(const StandingFile&) = delete;

  /// The disk goes on, until nobody has the file open for writing.
  void take_all() {
    taking_ = std::thread([this] {
      std::array<char, 4096> piece;
      pollfd readable{fd_, POLLIN, 0};
      while (::poll(&readable, 1, -1) > 0)
        if (::read(fd_, piece.data(), piece.size()) == 0) return;
    });
  }

 private:
  int fd_ = -1;
  std::thread taking_;
};

}  // namespace vergence::test
