#include "app/recorder/line_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "app/runtime/disk_errors.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

namespace {

constexpr std::size_t kLongestHead = 1024;  // bytes: that of calibrations.csv has some 700

/// What room mends. A disk that has none goes on where it stopped; EFBIG is a limit of the process.
bool lacks_room(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG; }

int open_for_lines(const std::filesystem::path& file) {
  return ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
}

/// → errno. Files that cannot be synchronised (pipes) say EINVAL; that is no loss.
int synchronise(int fd) { return ::fdatasync(fd) == 0 || errno == EINVAL ? 0 : errno; }

/// Where the last whole line ends; −1: it cannot be read.
off_t end_of_lines(int fd, off_t size) {
  std::array<char, 512> piece;
  for (off_t end = size; end > 0;) {
    const off_t at = std::max<off_t>(0, end - static_cast<off_t>(piece.size()));
    const auto wanted = static_cast<std::size_t>(end - at);
    if (::pread(fd, piece.data(), wanted, at) != static_cast<ssize_t>(wanted)) return -1;
    const auto newline = std::string_view(piece.data(), wanted).rfind('\n');
    if (newline != std::string_view::npos) return at + static_cast<off_t>(newline) + 1;
    end = at;
  }
  return 0;
}

/// A disk that went away may have kept half of a line. True: there was one, and it is gone.
bool cut_half_line(const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) return false;
  const off_t size = ::lseek(fd, 0, SEEK_END), end = end_of_lines(fd, size);
  const bool cut = end >= 0 && end < size && ::ftruncate(fd, end) == 0;
  (void)::close(fd);
  return cut;
}

}  // namespace

LineFile::LineFile(const std::filesystem::path& file, std::size_t pending, Away away)
    : path_(file), pending_(pending), fd_(open_for_lines(file)) {
  fault_ = fd_ < 0 ? errno : 0;
  const bool may_come = disk_is_away(fault_) || fault_ == ENOENT;
  if (fault_ != 0 && (away == Away::refuse || !may_come))
    throw InputError(file.string() + ": cannot be written (" + std::strerror(fault_) +
                     "): check the folder's permissions");
  waiting_.reserve(pending_ + kLongestHead);
}

LineFile::~LineFile() { close(); }

bool LineFile::append(std::string_view line) {
  const auto fits = [&] { return waiting_.size() + line.size() <= pending_; };
  // More lines than fit between two of the owner's flushes are no sign that the disk takes none.
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
  int error = pretend_full_ && !waiting_.empty() ? ENOSPC : 0;
  while (done < waiting_.size() && error == 0) {
    const ssize_t n = ::write(fd_, waiting_.data() + done, waiting_.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (n == 0 || errno != EINTR)
      error = n == 0 ? ENOSPC : errno;
  }
  if (done > 0) half_written_ = waiting_[done - 1] != '\n';
  waiting_.erase(0, done);
  fault_ = error;
  return error == 0;
}

void LineFile::write_back() noexcept {
  (void)::sync_file_range(fd_, 0, 0, SYNC_FILE_RANGE_WRITE);  // a pipe refuses: nothing is lost
}

bool LineFile::reopen(bool* fresh) {
  *fresh = false;
  // The rest of a line that is half written belongs to the old one, while that may yet take it.
  const bool flushed = flush();
  reopen_due_ = !flushed && !out_of_reach();
  if (reopen_due_) return false;
  const int fd = open_for_lines(path_);
  if (fd < 0) {
    if (flushed || fd_ < 0) fault_ = errno;  // else the old one's stands
    return false;
  }
  if (fd_ >= 0) {
    // Of one that is given up it is known.
    if (const int error = synchronise(fd_); error != 0 && flushed) left_fault_ = error;
    (void)::close(fd_);
  }
  fd_ = fd;
  if (!flushed) give_up_cut_line();
  struct stat status {};
  *fresh = ::fstat(fd_, &status) == 0 && status.st_size == 0;
  return true;
}

void LineFile::give_up_cut_line() noexcept {
  if (half_written_) waiting_.erase(0, waiting_.find('\n') + 1);  // a whole line's end is there
  if (cut_half_line(path_) || half_written_) ++lost_lines_;
  half_written_ = false;
}

bool LineFile::wants_room() const noexcept { return lacks_room(fault_); }

bool LineFile::out_of_reach() const noexcept { return fd_ < 0 || (fault_ != 0 && !wants_room()); }

std::size_t LineFile::waiting_lines() const noexcept {
  return static_cast<std::size_t>(std::count(waiting_.begin(), waiting_.end(), '\n'));
}

bool LineFile::close() {
  if (fd_ < 0) return fault_ == 0;
  bool good = flush();
  if (const int error = good ? synchronise(fd_) : 0; error != 0) {
    fault_ = error;
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
