#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

namespace vergence::app {

/// A file that grows by whole lines and survives a full disk, and one that goes away and comes
/// back.
///
/// What the system does not take stays in memory and is tried again with the next flush(); when as
/// many bytes wait as it may keep, new lines are refused and counted. So a file never holds a line
/// that lacks its end in the middle, and goes on when room comes back. A disk that was gone gives
/// the old descriptor errors for ever: out_of_reach() says so, reopen() finds the file by its name.
///
/// Threads  One. Memory  A buffer of `pending` bytes, taken at the beginning.
/// Errors   The constructor throws InputError, unless told to wait for the disk. Afterwards nothing
///          throws: a failure is kept in fault().
class LineFile {
 public:
  static constexpr std::size_t kPending = std::size_t{1} << 20;  // bytes: minutes of poses

  enum class Away : std::uint8_t { refuse, wait };

  /// Opens for appending; made when it is not there. `pending`: bytes that may wait. `away`: what
  /// to do where the disk is (disk_is_away()), or the folder not there yet; wait: as one that went
  /// out of reach.
  explicit LineFile(const std::filesystem::path& file, std::size_t pending = kPending,
                    Away away = Away::refuse);
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  /// Takes a line, end of line included. Nothing is written yet, unless as much waits as may: then
  /// it is flushed first. False: the disk does not take that; the line is lost and counted.
  bool append(std::string_view line);
  /// Hands the system what is waiting. False: not all was taken; fault() says why.
  bool flush();
  /// Asks the system to begin with writing what it was handed to the disk, and does not wait. By
  /// itself it begins after 30 s (vm.dirty_expire_centisecs), and so much a power cut would cost.
  void write_back() noexcept;
  /// Hands over what is waiting and opens the file anew by its name: what was moved away stays as
  /// it is, and a new one begins. *fresh: it is empty. False: it cannot be opened, or something
  /// still waits for room in the old one, which stays in use; fault() says why.
  /// Out of reach, the old one is given up: whole lines that wait are for the file of that name,
  /// with the next flush(); a line that is cut, there or here, is lost and counted.
  bool reopen(bool* fresh);
  /// errno of a file that reopen() left behind and that the disk may not have whole, since the last
  /// call; 0: none.
  [[nodiscard]] int take_left_fault() noexcept { return std::exchange(left_fault_, 0); }
  /// The last reopen() had to wait: to be called again once flush() says true.
  [[nodiscard]] bool reopen_due() const noexcept { return reopen_due_; }
  /// The last flush() failed for want of room.
  [[nodiscard]] bool wants_room() const noexcept;
  /// The last flush() failed, and not for want of room: the descriptor may never take a line again.
  /// Or there is none yet.
  [[nodiscard]] bool out_of_reach() const noexcept;
  /// Before all that waits: the first line of a file that reopen() found empty. Once is enough.
  void begin_with(std::string_view head) {
    if (!waiting_.starts_with(head)) waiting_.insert(0, head);
  }
  /// Lines that wait, the rest of one among them.
  [[nodiscard]] std::size_t waiting_lines() const noexcept;
  /// flush(), then asks the system to put it on the disk, and closes. Twice is harmless.
  bool close();

  /// From now on, or no longer, as if the disk had no room: for drives that test it.
  void pretend_full(bool full) noexcept { pretend_full_ = full; }

  /// errno of the last failure; 0 when none is standing, that is when all has been written since.
  [[nodiscard]] int fault() const noexcept { return fault_; }
  [[nodiscard]] std::uint64_t lost_lines() const noexcept { return lost_lines_; }
  [[nodiscard]] std::size_t pending() const noexcept { return pending_; }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  void give_up_cut_line() noexcept;

  std::filesystem::path path_;
  std::size_t pending_ = kPending;
  int fd_ = -1;
  int fault_ = 0, left_fault_ = 0;
  bool pretend_full_ = false, reopen_due_ = false;
  bool half_written_ = false;  // waiting_ begins within a line
  std::uint64_t lost_lines_ = 0;
  std::string waiting_;
};

}  // namespace vergence::app
