#include "app/session/session_quota.hpp"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

struct EndedSession {
  fs::path folder;
  fs::file_time_type ended{};
  std::uint64_t bytes = 0;
};

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

/// Oldest first.
std::vector<EndedSession> sessions_beside(const fs::path& session) {
  std::vector<EndedSession> found;
  std::error_code error;
  fs::path self = fs::absolute(session, error).lexically_normal();
  if (!self.has_filename()) self = self.parent_path();
  for (fs::directory_iterator at(self.parent_path(), error), end; !error && at != end;
       at.increment(error)) {
    std::error_code ignored;
    const fs::path& folder = at->path();
    if (folder == self || at->is_symlink(ignored) || !fs::exists(folder / "poses.csv", ignored))
      continue;
    const auto ended = fs::last_write_time(folder / "summary.json", ignored);
    if (!ignored) found.push_back({folder, ended, bytes_in(folder)});
  }
  std::ranges::sort(found, [](const EndedSession& a, const EndedSession& b) {
    return a.ended != b.ended ? a.ended < b.ended : a.folder < b.folder;
  });
  return found;
}

}  // namespace

std::vector<std::string> keep_session_quota(const fs::path& session, std::uint64_t max_bytes) {
  const std::vector<EndedSession> sessions = sessions_beside(session);
  std::uint64_t bytes = 0;
  for (const EndedSession& s : sessions) bytes += s.bytes;
  std::vector<std::string> messages;
  for (const EndedSession& s : sessions) {
    if (bytes <= max_bytes) break;
    bytes -= s.bytes;
    std::error_code error;
    fs::remove_all(s.folder, error);
    messages.push_back(
        error ? fmt::format("{}: is over sessions.quota_mb and cannot be removed ({}); check its "
                            "permissions",
                            s.folder.string(), error.message())
              : fmt::format("{}: removed ({} MB), the oldest session over sessions.quota_mb",
                            s.folder.string(), (s.bytes + 999'999) / 1'000'000));
  }
  return messages;
}

}  // namespace vergence::app
