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

}  // namespace vergence::app
