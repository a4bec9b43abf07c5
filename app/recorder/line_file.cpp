#include "app/recorder/line_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "app/runtime/errors.hpp"

namespace vergence::app {

namespace {

int open_for_lines(const std::filesystem::path& file) {
  return ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
}

}  // namespace

LineFile::LineFile(const std::filesystem::path& file, std::size_t pending)
    : path_(file), pending_(pending), fd_(open_for_lines(file)) {
  if (fd_ < 0)
    throw InputError(file.string() + ": cannot be written (" + std::strerror(errno) +
                     "): check the folder's permissions");
  waiting_.reserve(pending_);
}

LineFile::~LineFile() { close(); }

bool LineFile::append(std::string_view line) {
  if (waiting_.size() + line.size() > pending_) {
    ++lost_lines_;
    return false;
  }
  waiting_.append(line);
  return true;
}

bool LineFile::flush() {
  std::size_t done = 0;
  int error = pretend_full_ && !waiting_.empty() ? ENOSPC : 0;
  while (done < waiting_.size() && error == 0) {
    const ssize_t n = ::write(fd_, waiting_.data() + done, waiting_.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (n == 0 || errno != EINTR)
      error = n == 0 ? ENOSPC : errno;
  }
  waiting_.erase(0, done);
  fault_ = error;
  return error == 0;
}

void LineFile::write_back() noexcept {
  (void)::sync_file_range(fd_, 0, 0, SYNC_FILE_RANGE_WRITE);  // a pipe refuses: nothing is lost
}

bool LineFile::reopen(bool* fresh) {
  *fresh = false;
  // The rest of a line that is half written belongs to the old one.
  reopen_due_ = !flush();
  if (reopen_due_) return false;
  const int fd = open_for_lines(path_);
  if (fd < 0) {
    fault_ = errno;
    return false;
  }
  (void)::fdatasync(fd_);
  (void)::close(fd_);
  fd_ = fd;
  struct stat status {};
  *fresh = ::fstat(fd_, &status) == 0 && status.st_size == 0;
  return true;
}

bool LineFile::close() {
  if (fd_ < 0) return fault_ == 0;
  bool good = flush();
  // Files that cannot be synchronised (pipes) say EINVAL; that is no loss.
  if (good && ::fdatasync(fd_) != 0 && errno != EINVAL) {
    fault_ = errno;
    good = false;
  }
  if (::close(fd_) != 0 && good) {
    fault_ = errno;
    good = false;
  }
  fd_ = -1;
  return good;
}

}  // namespace vergence::app
