#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace vergence::app {

/// A file that grows by whole lines, also over a disk that is full for a while.
///
/// Lines are buffered until flush(). What the system does not take stays in the buffer and is
/// written by a later flush(), to the same open file. Lines that find the buffer full are refused
/// and counted, so the file never lacks a line's end in the middle.
///
/// Threads  One. Memory  A buffer of `pending` bytes, taken by the constructor.
/// Errors   The constructor throws InputError. Afterwards nothing throws: see fault().
class LineFile {
 public:
  static constexpr std::size_t kPending = std::size_t{1} << 20;  // bytes: minutes of poses

  /// Opens for appending; made when it is not there. `pending`: bytes that may wait.
  explicit LineFile(const std::filesystem::path& file, std::size_t pending = kPending);
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  /// Takes a line, end of line included; flushed first if the buffer is full. False: refused and
  /// counted.
  bool append(std::string_view line);
  /// Hands the buffer to the system. False: not all was taken; fault() says why.
  bool flush();
  /// Asks the system to begin writing to the disk, and does not wait. Without it the kernel begins
  /// after 30 s (vm.dirty_expire_centisecs), which a power cut would cost.
  void write_back() noexcept;
  /// flush(), then asks the system to put it on the disk, and closes. Twice is harmless.
  bool close();

  /// Simulates a disk without room, until called with false.
  void pretend_full(bool full) noexcept { pretend_full_ = full; }

  /// errno of the last flush() or close(); 0: it succeeded.
  [[nodiscard]] int fault() const noexcept { return fault_; }
  [[nodiscard]] std::uint64_t lost_lines() const noexcept { return lost_lines_; }
  [[nodiscard]] std::size_t pending() const noexcept { return pending_; }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  std::size_t pending_ = kPending;
  int fd_ = -1;
  int fault_ = 0;
  bool pretend_full_ = false;
  std::uint64_t lost_lines_ = 0;
  std::string waiting_;
};

}  // namespace vergence::app
