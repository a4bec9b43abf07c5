#pragma once
#include <filesystem>
#include <string_view>

namespace vergence::app {

/// Puts a whole file in the place of another: written beside it, synchronised, renamed, the folder
/// synchronised. A power cut or a full disk leaves the old file or the new one, never a part.
/// Devices and folders are not replaced.
///
/// Threads  Two writers of one file at a time spoil each other's. Errors  InputError with the file,
/// what the system says and what to do.
void replace_durably(const std::filesystem::path& file, std::string_view text);

/// Returns true if the session's folder exists and is empty. InputError: it exists and is not
/// empty, or is no folder.
bool check_session_folder(const std::filesystem::path& folder);
/// Makes the folder of a session. False: it was there, empty. InputError: it exists and is not
/// empty, is no folder, or cannot be made.
bool make_session_folder(const std::filesystem::path& folder);
/// Undoes make_session_folder(): removes what is in the folder, and with `made` the folder itself.
void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept;

}  // namespace vergence::app
