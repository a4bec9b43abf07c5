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
/// As make_session_folder(), for a drive that waits for no disk. → errno where disk_is_away():
/// nothing is there, and make_folders() may come to it later. 0: *made as above.
[[nodiscard]] int try_session_folder(const std::filesystem::path& folder, bool* made);
/// Makes a folder and those above it. → errno; 0: it is there. Takes no memory.
[[nodiscard]] int make_folders(const char* folder) noexcept;
/// As if there never had been a session: what is in the folder goes, and with `made` the folder.
void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept;

/// What a session's folder bears for those who remove old ones, whatever the clock says: a lock
/// (flock(2)) while it is written, which the kernel drops with the process, and in the file
/// `session_number` how many drives beside it were before.
///
/// Threads  One. Memory  None. Errors  A lock or file that cannot be had is done without.
class SessionMark {
 public:
  static constexpr const char* kFile = "session_number";

  /// `number` 0: none is written.
  SessionMark(std::uint64_t number, const char* folder) noexcept : number_(number) {
    put_on(folder);
  }
  ~SessionMark();
  SessionMark(const SessionMark&) = delete;
  SessionMark& operator=(const SessionMark&) = delete;

  /// Once more, where the folder was not there or another one may have the name by now.
  void put_on(const char* folder) noexcept;

 private:
  std::uint64_t number_;
  int fd_ = -1;  // of the folder
};

}  // namespace vergence::app
