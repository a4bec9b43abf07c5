#pragma once
#include <filesystem>

namespace vergence::app {

/// Makes the folder of a session. InputError: it exists and is not empty, is no folder, or cannot
/// be made.
void make_session_folder(const std::filesystem::path& folder);

}  // namespace vergence::app
