#include "app/recorder/session_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>

#include "app/runtime/disk_errors.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

/// Whole and on the disk, or not there: a number that a power cut took would make a new session the
/// oldest.
void write_number(int folder, std::uint64_t number) noexcept {
  const int fd =
      ::openat(folder, SessionMark::kFile, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd < 0) return;
  std::array<char, 32> text{};
  const int size =
      std::snprintf(text.data(), text.size(), "%llu\n", static_cast<unsigned long long>(number));
  const bool whole = ::write(fd, text.data(), static_cast<std::size_t>(size)) == size;
  (void)::fsync(fd);
  (void)::close(fd);
  if (!whole) (void)::unlinkat(folder, SessionMark::kFile, 0);
  (void)::fsync(folder);
}

InputError cannot_be_made(const std::filesystem::path& folder, int error) {
  return InputError(folder.string() + ": cannot be made (" + std::strerror(error) +
                    "): check the folder above it");
}

}  // namespace

bool check_session_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const std::string name = folder.string();
  if (name.empty()) throw InputError("--out is empty; name a folder for the session");
  std::error_code error;
  if (!fs::exists(folder, error)) return false;
  if (!fs::is_directory(folder, error))
    throw InputError(name +
                     ": is not a folder; name a new or empty one for the session with --out");
  const bool empty = fs::is_empty(folder, error);
  if (error)
    throw InputError(name + ": cannot be looked into (" + error.message() +
                     "): check its permissions");
  if (!empty)
    throw InputError(
        name +
        ": is not empty, and nothing is ever overwritten; name a new or empty folder with --out");
  return true;
}

bool make_session_folder(const std::filesystem::path& folder) {
  bool made = false;
  if (const int error = try_session_folder(folder, &made); error != 0)
    throw cannot_be_made(folder, error);
  return made;
}

int try_session_folder(const std::filesystem::path& folder, bool* made) {
  *made = !check_session_folder(folder);
  if (!*made) return 0;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error && !disk_is_away(error.value())) throw cannot_be_made(folder, error.value());
  return error.value();
}

int make_folders(const char* folder) noexcept {
  std::array<char, PATH_MAX> path{};
  const std::size_t size = std::strlen(folder);
  if (size == 0 || size >= path.size()) return ENAMETOOLONG;
  for (std::size_t i = 0; i <= size; ++i) {
    const bool ends = i > 0 && path[i - 1] != '/' && (folder[i] == '/' || folder[i] == '\0');
    if (ends && ::mkdir(path.data(), 0777) != 0 && errno != EEXIST) {
      struct stat status {};  // a read-only disk does not say of every folder that it is there
      const int error = errno;
      if (::stat(path.data(), &status) != 0) return error;
    }
    path[i] = folder[i];
  }
  return 0;
}

void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept {
  namespace fs = std::filesystem;
  std::error_code error;
  if (made) {
    fs::remove_all(folder, error);
    return;
  }
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    fs::remove_all(entry->path(), ignored);
  }
}

SessionMark::~SessionMark() {
  if (fd_ >= 0) (void)::close(fd_);
}

void SessionMark::put_on(const char* folder) noexcept {
  const int fd = ::open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  if (number_ > 0) write_number(fd, number_);
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {  // it is this session's already
    (void)::close(fd);
    return;
  }
  if (fd_ >= 0) (void)::close(fd_);
  fd_ = fd;
}

}  // namespace vergence::app
