#pragma once
#include <filesystem>

namespace vergence::app {

/// Whether the folder of a session is there, empty. InputError: it exists and is not empty, or is
/// no folder.
bool check_session_folder(const std::filesystem::path& folder);
/// Makes the folder of a session. False: it was there, empty. InputError: it exists and is not
/// empty, is no folder, or cannot be made.
bool make_session_folder(const std::filesystem::path& folder);
/// As if there never had been a session: what is in the folder goes, and with `made` the folder.
void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept;

}  // namespace vergence::app
