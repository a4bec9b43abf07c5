#pragma once
#include <fcntl.h>
#include <unistd.h>

#include <charconv>
#include <filesystem>
#include <string>

namespace vergence::test {

/// Makes every descriptor of this process that is open on `file` one that refuses what is written,
/// as one of a disk that went away; with O_PATH also to bring to the disk what it had taken. → how
/// many there were.
inline int break_descriptors_of(const std::filesystem::path& file, int how = O_RDONLY) {
  namespace fs = std::filesystem;
  int broken = 0;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    if (fs::read_symlink(entry.path(), gone) != file) continue;
    const std::string name = entry.path().filename().string();
    int fd = -1;
    std::from_chars(name.data(), name.data() + name.size(), fd);
    const int unwritable = ::open("/dev/null", how | O_CLOEXEC);
    broken += ::dup2(unwritable, fd) == fd ? 1 : 0;
    (void)::close(unwritable);
  }
  return broken;
}

}  // namespace vergence::test
