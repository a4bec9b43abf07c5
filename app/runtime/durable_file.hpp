#pragma once
#include <filesystem>
#include <string_view>

namespace vergence::app {

/// Replaces a file atomically: writes a temporary file next to it, synchronises, renames and
/// synchronises the directory. A power cut or a full disk leaves the old or the new file, never a
/// part. Devices and directories are not replaced.
///
/// Two simultaneous writers of one file corrupt it. Throws InputError with the file, the system's
/// reason and the fix.
void replace_durably(const std::filesystem::path& file, std::string_view text);

/// Returns true if the session's directory exists and is empty. Throws InputError if it is not
/// empty, or not a directory.
bool check_session_folder(const std::filesystem::path& folder);
/// Makes the directory of a session. Returns false if it existed and was empty. Throws InputError
/// if it is not empty, not a directory, or cannot be made.
bool make_session_folder(const std::filesystem::path& folder);
/// Undoes make_session_folder(): removes the directory's content and, with `made`, the directory.
void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept;

}  // namespace vergence::app
