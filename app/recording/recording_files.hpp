#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "app/recording/mcap_file.hpp"
#include "app/recording/messages.hpp"
#include "core/memory/ring.hpp"
#include "core/types/time.hpp"

namespace vergence::app {

/// Topic of a recording. Its number is its index in the list.
struct RecordedTopic {
  std::string name;
  RosType type = RosType::text;
  /// If true, late subscribers receive the last message (tf_static).
  bool latched = false;
};

/// Message at the beginning of every file.
struct RecordingPreamble {
  std::size_t topic = 0;
  /// Encoded as CDR.
  std::vector<std::uint8_t> message{};
};

/// Files of a recording and the state of their disk: `drive.mcap`, or from the second file on
/// `drive_0.mcap`, `drive_1.mcap`, …
///
/// Threads  The writer calls append(), roll(), finish() and resting(). Messages and counters are
///          thread-safe.
/// Memory   Allocated at construction.
/// Errors   A failed write is retried in the same file with the same data every kRetry; see
///          resting(). pop_errors() has the messages for the user.
class RecordingFiles {
 public:
  static constexpr Duration kRetry = Duration::seconds(3);
  struct Options {
    std::vector<RecordedTopic> topics;
    std::vector<RecordingPreamble> preamble{};
    /// A file is ended at this size; 0 disables this.
    std::uint64_t roll_bytes = 0;
    /// Null selects the disk of the system.
    Disk* disk = nullptr;
  };
  using Parts = std::span<const std::span<const std::uint8_t>>;

  /// `folder` must exist. Throws InputError if no file can be made there.
  RecordingFiles(const std::filesystem::path& folder, const Options& options);

  /// Same as McapFile::write_chunk(), in a new file if none is open. `first` is the time of the
  /// first message in ns, `lost` the number of messages lost so far because of the disk. Returns
  /// the growth of the file in bytes; 0 on failure.
  [[nodiscard]] std::uint64_t append(Parts parts, std::uint64_t first, std::uint64_t lost) noexcept;
  /// Ends a full file; the next append() begins another.
  void roll() noexcept;
  /// Ends the last file. `time` is that of a preamble without messages, in ns.
  void finish(std::uint64_t time) noexcept;
  /// True shortly after a failure, when the disk should not be used yet.
  [[nodiscard]] bool resting() const noexcept;

  /// Messages about the disk since the last call.
  [[nodiscard]] std::vector<std::string> pop_errors();
  [[nodiscard]] std::uint64_t files() const noexcept {
    return files_.load(std::memory_order_relaxed);
  }
  /// Number of messages accepted by append() but not written to the disk.
  [[nodiscard]] std::uint64_t unwritten() const noexcept {
    return unwritten_.load(std::memory_order_relaxed);
  }

 private:
  struct Notice {
    enum class Kind : std::uint8_t { good_again, failed, unfinished, unwritten } kind{};
    // Value of errno.
    int error = 0;
    // Number of lost messages so far.
    std::uint64_t lost = 0;
    int file = 0;
  };

  /// Opens a file. Returns 0 or errno.
  [[nodiscard]] int open() noexcept;
  [[nodiscard]] int write_preamble(std::uint64_t time) noexcept;
  void fail(int error) noexcept;
  void end_file() noexcept;
  void record_unwritten() noexcept;
  void begin_next_number() noexcept;
  [[nodiscard]] const char* path(std::vector<char>* out) const noexcept;
  [[nodiscard]] std::string message(const Notice& notice) const;

  const std::string folder_;
  const std::uint64_t roll_bytes_;
  const std::vector<McapTopic> topics_;
  // Contains Message records.
  std::vector<std::uint8_t> preamble_;
  Disk& disk_;
  McapFile file_;

  // Used by the writer's thread only.

  // Number of the current file.
  int number_ = 0;
  // True if file names are numbered.
  bool several_ = false;
  // True if the current file lacks its preamble.
  bool preamble_due_ = false;
  // True if the last write failed.
  bool failing_ = false;
  // Monotonic time of the next attempt.
  std::int64_t retry_ns_ = 0;
  std::vector<char> path_, other_path_;

  std::atomic<std::uint64_t> files_{0}, unwritten_{0};
  // Passed from the writer to pop_errors().
  Ring<Notice, 64> notices_;
  // Guards concurrent calls of pop_errors().
  std::mutex errors_mutex_;
};

}  // namespace vergence::app
