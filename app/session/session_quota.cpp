#include "app/session/session_quota.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <system_error>
#include <tuple>

#include <fmt/format.h>

#include "app/recorder/record_lines.hpp"
#include "app/recorder/session_folder.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

struct OldSession {
  fs::path folder;
  std::uint64_t number = 0;  // 0: it has none
  fs::file_time_type written{};
  std::uint64_t bytes = 0;
};

bool has_poses(const fs::path& folder) {
  std::ifstream in(folder / "poses.csv", std::ios::binary);
  std::string head(std::string_view(kPosesHeader).size(), '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  return in && head == kPosesHeader;
}

/// When the newest of its files was.
fs::file_time_type last_written(const fs::path& folder) {
  fs::file_time_type newest = fs::file_time_type::min();
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (!at->is_regular_file(ignored) || at->is_symlink(ignored)) continue;
    const auto written = fs::last_write_time(at->path(), ignored);
    if (!ignored && written > newest) newest = written;
  }
  return newest;
}

/// 0: it has none, or none that can be.
std::uint64_t number_of(const fs::path& folder) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 53U;
  std::ifstream in(folder / SessionMark::kFile);
  std::uint64_t number = 0;
  return in >> number && number < kMost ? number : 0;
}

/// Whether somebody holds its lock. Where there are no locks: whether it was never ended.
bool is_being_written(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return false;
  const int error = ::flock(fd, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
  (void)::close(fd);
  std::error_code ignored;
  return error == EWOULDBLOCK || (error != 0 && !fs::exists(folder / "summary.json", ignored));
}

std::uint64_t bytes_in(const fs::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end;
       at.increment(error)) {
    std::error_code ignored;
    if (at->is_regular_file(ignored) && !at->is_symlink(ignored))
      if (const auto size = at->file_size(ignored); !ignored) bytes += size;
  }
  return bytes;
}

/// The folder that the session lies in. Behind a slash or a dot at its end there is no name to take
/// away.
fs::path folder_above(const fs::path& session) {
  std::error_code error;
  const fs::path path = fs::absolute(session, error).lexically_normal();
  return path.has_filename() ? path.parent_path() : path.parent_path().parent_path();
}

/// → the first error. poses.csv, the mark of a session, stays until all else is gone.
std::error_code remove_session(const fs::path& folder) {
  std::error_code first, error;
  std::vector<fs::path> inside;
  for (fs::directory_iterator at(folder, first), end; !first && at != end; at.increment(first))
    if (at->path().filename() != "poses.csv") inside.push_back(at->path());
  for (const fs::path& path : inside) {
    fs::remove_all(path, error);
    if (error && !first) first = error;
  }
  if (!first) fs::remove(folder / "poses.csv", first);
  if (!first) fs::remove(folder, first);
  return first;
}

/// Another file system begins there: no session, and one that is away would hold up the drive.
bool is_mounted(const fs::path& folder) {
  constexpr int kAskNobody = AT_STATX_DONT_SYNC | AT_NO_AUTOMOUNT | AT_SYMLINK_NOFOLLOW;
  struct statx status {};
  return ::statx(AT_FDCWD, folder.c_str(), kAskNobody, STATX_TYPE, &status) == 0 &&
         (status.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0;
}

/// Folders beside it.
std::vector<fs::path> folders_beside(const fs::path& session) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator at(folder_above(session), error), end; !error && at != end;
       at.increment(error)) {
    std::error_code ignored;
    if (!is_mounted(at->path()) && !at->is_symlink(ignored) && at->is_directory(ignored) &&
        !fs::equivalent(at->path(), session, ignored))
      found.push_back(at->path());
  }
  return found;
}

/// Oldest first.
std::vector<OldSession> sessions_beside(const fs::path& session) {
  std::vector<OldSession> found;
  for (const fs::path& folder : folders_beside(session))
    if (has_poses(folder) && !is_being_written(folder))
      found.push_back({folder, number_of(folder), last_written(folder), bytes_in(folder)});
  std::sort(found.begin(), found.end(), [](const OldSession& a, const OldSession& b) {
    return std::tie(a.number, a.written, a.folder) < std::tie(b.number, b.written, b.folder);
  });
  return found;
}

}  // namespace

std::uint64_t next_session_number(const fs::path& session) {
  std::uint64_t greatest = 0;
  for (const fs::path& folder : folders_beside(session))
    greatest = std::max(greatest, number_of(folder));
  return greatest + 1;
}

std::vector<std::string> keep_session_quota(const fs::path& session, std::uint64_t most_bytes) {
  const std::vector<OldSession> sessions = sessions_beside(session);
  std::uint64_t bytes = 0;
  for (const OldSession& s : sessions) bytes += s.bytes;
  std::vector<std::string> sentences;
  for (const OldSession& s : sessions) {
    if (bytes <= most_bytes) break;
    bytes -= s.bytes;
    if (const std::error_code error = remove_session(s.folder)) {
      sentences.push_back(fmt::format(
          "{}: is over sessions.quota_mb and cannot be removed ({}): check its permissions",
          s.folder.string(), error.message()));
      continue;
    }
    sentences.push_back(
        fmt::format("{}: removed ({} MB), the oldest session over sessions.quota_mb",
                    s.folder.string(), (s.bytes + 999'999) / 1'000'000));
  }
  return sentences;
}

}  // namespace vergence::app
