#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vergence::app {

/// Removes the oldest session directories next to `session` until the remaining ones take at most
/// `max_bytes` together. `session` itself is neither counted nor removed, and need not exist yet.
/// Returns one message for each directory that was removed or could not be removed.
///
/// A session is a directory, not a link, with `poses.csv` and `summary.json`. A session that is
/// still being written has no summary, and one that was cut off is kept for diagnosis. The oldest
/// session has the oldest summary. Not thread-safe. Skips directories that cannot be read.
[[nodiscard]] std::vector<std::string> keep_session_quota(const std::filesystem::path& session,
                                                          std::uint64_t max_bytes);

}  // namespace vergence::app
