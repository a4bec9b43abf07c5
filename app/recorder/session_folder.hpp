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

/// Marks a session's folder for those who remove old ones: a lock (flock(2)) while it is written,
/// which the kernel drops with the process, and in the file `session_number` how many sessions
/// beside it were before.
///
/// Threads  One. Memory  None. Errors  A lock or file that cannot be had is done without.
class SessionMark {
 public:
  static constexpr const char* kFile = "session_number";

  /// `folder` exists. `number` 0: none is written.
  SessionMark(std::uint64_t number, const char* folder) noexcept;
  ~SessionMark();
  SessionMark(const SessionMark&) = delete;
  SessionMark& operator=(const SessionMark&) = delete;

 private:
  int fd_ = -1;  // of the folder
};

}  // namespace vergence::app
