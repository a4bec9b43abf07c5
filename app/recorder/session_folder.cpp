#include "app/recorder/session_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <string>
#include <system_error>

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
  if (check_session_folder(folder)) return false;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw InputError(folder.string() + ": cannot be made (" + error.message() +
                     "): check that disk and the folder above it");
  return true;
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

SessionMark::SessionMark(std::uint64_t number, const char* folder) noexcept
    : fd_(::open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (fd_ < 0) return;
  if (number > 0) write_number(fd_, number);
  (void)::flock(fd_, LOCK_EX | LOCK_NB);
}

SessionMark::~SessionMark() {
  if (fd_ >= 0) (void)::close(fd_);
}

}  // namespace vergence::app
