#include "app/session/session_folder.hpp"

#include <string>
#include <system_error>

#include "app/runtime/errors.hpp"

namespace vergence::app {
bool check_session_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const std::string name = folder.string();
  if (name.empty()) throw InputError("--out is empty; name a folder for the session");
  std::error_code error;
  if (!fs::exists(folder, error)) return false;
  if (!fs::is_directory(folder, error))
    throw InputError(name +
                     ": is not a folder; name a new or empty one for the session with --out");
  const bool empty = fs::is_empty(folder, error);
  if (error)
    throw InputError(name + ": cannot be looked into (" + error.message() +
                     "): check its permissions");
  if (!empty)
    throw InputError(
        name +
        ": is not empty, and nothing is ever overwritten; name a new or empty folder with --out");
  return true;
}

bool make_session_folder(const std::filesystem::path& folder) {
  if (check_session_folder(folder)) return false;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw InputError(folder.string() + ": cannot be made (" + error.message() +
                     "): check that disk and the folder above it");
  return true;
}

void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept {
  namespace fs = std::filesystem;
  std::error_code error;
  if (made) {
    fs::remove_all(folder, error);
    return;
  }
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    fs::remove_all(entry->path(), ignored);
  }
}

}  // namespace vergence::app
