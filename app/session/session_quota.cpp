#include "app/session/session_quota.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "app/recorder/pose_line.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

struct OldSession {
  fs::path folder;
  fs::file_time_type written{};
  std::uint64_t bytes = 0;
};

bool has_poses(const fs::path& folder) {
  std::ifstream in(folder / "poses.csv", std::ios::binary);
  std::string head(std::string_view(kPosesHeader).size(), '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  return in && head == kPosesHeader;
}

/// When the newest of its files was written: while the cameras are gone a drive writes others than
/// poses.csv.
std::optional<fs::file_time_type> last_written(const fs::path& folder) {
  std::optional<fs::file_time_type> newest;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (!at->is_regular_file(ignored) || at->is_symlink(ignored)) continue;
    const auto written = fs::last_write_time(at->path(), ignored);
    if (!ignored && (!newest || written > *newest)) newest = written;
  }
  return newest;
}

/// What was written an hour ahead was cut off before a clock without a battery began anew.
bool may_go_on(const fs::path& folder, fs::file_time_type written) {
  std::error_code error;
  const auto age = fs::file_time_type::clock::now() - written;
  return !fs::exists(folder / "summary.json", error) &&
         std::chrono::abs(age) < std::chrono::hours(1);
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

/// Oldest first.
std::vector<OldSession> sessions_beside(const fs::path& session) {
  std::vector<OldSession> found;
  std::error_code error;
  for (fs::directory_iterator at(folder_above(session), error), end; !error && at != end;
       at.increment(error)) {
    std::error_code ignored;
    if (at->is_symlink(ignored) || !at->is_directory(ignored) ||
        fs::equivalent(at->path(), session, ignored) || !has_poses(at->path()))
      continue;
    const auto written = last_written(at->path());
    if (!written || may_go_on(at->path(), *written)) continue;
    found.push_back({at->path(), *written, bytes_in(at->path())});
  }
  std::sort(found.begin(), found.end(), [](const OldSession& a, const OldSession& b) {
    return a.written != b.written ? a.written < b.written : a.folder < b.folder;
  });
  return found;
}

}  // namespace

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
