#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vergence::app {

/// Removes the oldest session folders beside `session` until those left take at most `max_bytes`
/// together; `session` itself, which need not be there yet, is neither counted nor removed. → a
/// message for each that was removed, or could not be.
///
/// A session is a folder, no link, with `poses.csv` and `summary.json`: one that is still being
/// written has no summary, and one that was cut off is kept for diagnosis. Oldest is the
/// one whose summary is. Not thread-safe. Errors  None: what cannot be looked at is passed over.
[[nodiscard]] std::vector<std::string> keep_session_quota(const std::filesystem::path& session,
                                                          std::uint64_t max_bytes);

}  // namespace vergence::app
