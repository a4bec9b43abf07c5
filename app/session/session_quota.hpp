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
/// A session is a folder, no link, with poses.csv as this program writes it; its age is that of
/// poses.csv. One without summary.json whose poses.csv is younger than an hour is taken to be a
/// drive that goes on, and stays. poses.csv goes last: a session whose removal was cut short is
/// still one, and goes the next time. What else lies there is left alone and not counted. Threads
/// One. Errors  None: what cannot be looked at is passed over.
[[nodiscard]] std::vector<std::string> keep_session_quota(const std::filesystem::path& session,
                                                          std::uint64_t most_bytes);

}  // namespace vergence::app
