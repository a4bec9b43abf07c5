#include "app/runtime/durable_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "app/runtime/errors.hpp"
#include "app/runtime/file_descriptor.hpp"

namespace vergence::app {
namespace {

/// errno, 0 when all of it is on the disk.
int write_whole(const std::filesystem::path& file, std::string_view text) {
  FileDescriptor out(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!out) return errno;
  while (!text.empty()) {
    const ssize_t n = ::write(out.get(), text.data(), text.size());
    if (n > 0)
      text.remove_prefix(static_cast<std::size_t>(n));
    else if (n == 0 || errno != EINTR)
      return n == 0 ? ENOSPC : errno;
  }
  if (::fsync(out.get()) != 0) return errno;
  const int fd = out.get();
  out.release();
  return ::close(fd) == 0 ? 0 : errno;
}

/// The new name is on the disk only with the folder. File systems that cannot do that say EINVAL;
/// that is no loss.
int synchronise_folder(const std::filesystem::path& folder) {
  const FileDescriptor at(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!at) return errno;
  return ::fsync(at.get()) == 0 || errno == EINVAL ? 0 : errno;
}

}  // namespace

void replace_durably(const std::filesystem::path& file, std::string_view text) {
  struct stat old {};
  // A regular file in place of a device would remove the device for all programs.
  if (::stat(file.c_str(), &old) == 0 && !S_ISREG(old.st_mode))
    throw InputError(file.string() + ": cannot be replaced: not a regular file; name another file");
  std::filesystem::path fresh = file;
  fresh += ".new";
  int error = write_whole(fresh, text);
  if (error != 0) {
    (void)::unlink(fresh.c_str());
    throw InputError(file.string() + ": cannot be written (" + std::strerror(error) +
                     "); check the directory's permissions and the free space");
  }
  if (std::rename(fresh.c_str(), file.c_str()) != 0) {
    error = errno;
    (void)::unlink(fresh.c_str());
    throw InputError(file.string() + ": cannot be replaced (" + std::strerror(error) +
                     "); check the directory's permissions");
  }
  error = synchronise_folder(file.parent_path());
  if (error != 0)
    throw InputError(file.string() + ": is written, but may be lost in a power cut (" +
                     std::strerror(error) + "); check the disk");
}

bool check_session_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const std::string name = folder.string();
  if (name.empty()) throw InputError("--out is empty; name a directory for the session");
  std::error_code error;
  if (!fs::exists(folder, error)) return false;
  if (!fs::is_directory(folder, error))
    throw InputError(name + ": is not a directory; name a new or empty one with --out");
  const bool empty = fs::is_empty(folder, error);
  if (error)
    throw InputError(name + ": cannot be read (" + error.message() + "); check its permissions");
  if (!empty)
    throw InputError(name +
                     ": is not empty, and sessions are never overwritten; name a new or empty "
                     "directory with --out");
  return true;
}

bool make_session_folder(const std::filesystem::path& folder) {
  if (check_session_folder(folder)) return false;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw InputError(folder.string() + ": cannot be created (" + error.message() +
                     "); check the disk and the parent directory");
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

}  // namespace vergence::app
