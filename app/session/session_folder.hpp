#pragma once
#include <cstdint>
#include <filesystem>

namespace vergence::app {

/// Whether the folder of a session is there, empty. InputError: it exists and is not empty, or is
/// no folder.
bool check_session_folder(const std::filesystem::path& folder);
/// Makes the folder of a session. False: it was there, empty. InputError: it exists and is not
/// empty, is no folder, or cannot be made.
bool make_session_folder(const std::filesystem::path& folder);
/// Undoes make_session_folder(): removes what is in the folder, and with `made` the folder itself.
void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept;

}  // namespace vergence::app
