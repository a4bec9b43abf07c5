#include "app/runtime/process_threads.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace vergence::app {
namespace {

/// The kernel's directory entry (getdents64(2)), which opendir() would want heap for.
struct Entry {
  std::uint64_t inode;
  std::int64_t offset;
  std::uint16_t size;  // of the whole entry
  std::uint8_t type;
  char name[1];
};

/// A file's first line; empty: it is not there any more.
std::string_view first_line(const char* path, std::array<char, 64>* buffer) noexcept {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return {};
  const ssize_t got = ::read(file, buffer->data(), buffer->size());
  (void)::close(file);
  const std::string_view text(buffer->data(), got > 0 ? static_cast<std::size_t>(got) : 0);
  return text.substr(0, text.find('\n'));
}

void add_thread(const char* id, std::vector<ProcessThread>* threads) {
  const int number = static_cast<int>(std::strtol(id, nullptr, 10));  // 0: `.` and `..`
  if (number <= 0) return;
  std::array<char, 64> path{}, text{};
  (void)std::snprintf(path.data(), path.size(), "/proc/self/task/%d/comm", number);
  const std::string_view name = first_line(path.data(), &text);
  if (!name.empty()) threads->push_back({static_cast<pid_t>(number), std::string(name)});
}

}  // namespace

void process_threads(std::vector<ProcessThread>* threads) {
  threads->clear();
  const int folder = ::open("/proc/self/task", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  alignas(Entry) std::array<char, 4096> buffer;
  for (;;) {
    const long got = ::syscall(SYS_getdents64, folder, buffer.data(), buffer.size());
    if (got <= 0) break;
    for (std::size_t at = 0; at < static_cast<std::size_t>(got);) {
      std::uint16_t size = 0;
      std::memcpy(&size, buffer.data() + at + offsetof(Entry, size), sizeof size);
      add_thread(buffer.data() + at + offsetof(Entry, name), threads);
      at += std::max<std::size_t>(size, 1);
    }
  }
  (void)::close(folder);
}

}  // namespace vergence::app
