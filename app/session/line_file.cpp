#include "app/session/line_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "app/runtime/errors.hpp"

namespace vergence::app {

LineFile::LineFile(const std::filesystem::path& file, std::size_t pending)
    : path_(file),
      pending_(pending),
      fd_(::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (fd_ < 0)
    throw InputError(file.string() + ": cannot be written (" + std::strerror(errno) +
                     "): check that disk and the folder's permissions");
  waiting_.reserve(pending_);
}

LineFile::~LineFile() { close(); }

bool LineFile::append(std::string_view line) {
  const auto fits = [&] { return waiting_.size() + line.size() <= pending_; };
  // A full buffer between two of the owner's flushes is no sign of a full disk.
  if (!fits() && (fault_ != 0 || !flush() || !fits())) {
    ++lost_lines_;
    return false;
  }
  waiting_.append(line);
  return true;
}

bool LineFile::flush() {
  if (fd_ < 0) return false;
  std::size_t done = 0;
  fault_ = pretend_full_ && !waiting_.empty() ? ENOSPC : 0;
  while (done < waiting_.size() && fault_ == 0) {
    const ssize_t n = ::write(fd_, waiting_.data() + done, waiting_.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (n == 0 || errno != EINTR)
      fault_ = n == 0 ? ENOSPC : errno;
  }
  waiting_.erase(0, done);
  return fault_ == 0;
}

void LineFile::write_back() noexcept {
  (void)::sync_file_range(fd_, 0, 0, SYNC_FILE_RANGE_WRITE);  // a pipe refuses: nothing is lost
}

bool LineFile::close() {
  if (fd_ < 0) return fault_ == 0;
  // Pipes cannot be synchronised and report EINVAL, which is no loss.
  if (flush() && ::fdatasync(fd_) != 0 && errno != EINVAL) fault_ = errno;
  if (::close(fd_) != 0 && fault_ == 0) fault_ = errno;
  fd_ = -1;
  return fault_ == 0;
}

}  // namespace vergence::app
