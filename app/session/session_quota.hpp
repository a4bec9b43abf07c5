#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vergence::app {

/// Removes the oldest session folders beside `session` until those left take at most `most_bytes`
/// together; `session` itself, which need not be there yet, is neither counted nor removed. → a
/// sentence for each that was removed, or could not be: that one counts no more, so that no newer
/// one goes in its place.
///
/// A session is a folder, no link and no mount, with poses.csv as this program writes it. One that
/// bears the lock of a SessionMark is being written, and stays. Oldest is the one of the smallest
/// number; those without a number are older than those with one, and among themselves as old as
/// their newest file says. So a clock without a battery, which begins at the same date with every
/// boot, decides nothing. poses.csv goes last: a session whose removal was cut short is still one,
/// and goes the next time. What else lies there is left alone and not counted. Threads  One. Errors
/// None: what cannot be looked at is passed over.
[[nodiscard]] std::vector<std::string> keep_session_quota(const std::filesystem::path& session,
                                                          std::uint64_t most_bytes);

/// The number of a new session: one more than the greatest of the folders beside it.
[[nodiscard]] std::uint64_t next_session_number(const std::filesystem::path& session);

}  // namespace vergence::app
