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

/// One topic of a recording. Its number is its place in the list.
struct RecordedTopic {
  std::string name;
  RosType type = RosType::text;
  /// Late subscribers receive the last message (tf_static).
  bool latched = false;
};

/// A message at the beginning of every file.
struct RecordingPreamble {
  std::size_t topic = 0;
  std::vector<std::uint8_t> message{};  // CDR
};

/// The files of a recording, one after the other, and how their disk is: `drive.mcap`, or once
/// there is a second one `drive_0.mcap`, `drive_1.mcap`, …
///
/// Threads  append(), roll(), finish(), resting(): the writer's. Sentences and counters: any.
/// Memory   All at construction.
/// Errors   A write that fails is tried again in the same file with the same data, every
///          kRetry: see resting(). Messages for the user: pop_errors().
class RecordingFiles {
 public:
  static constexpr Duration kRetry = Duration::seconds(3);
  struct Options {
    std::vector<RecordedTopic> topics;
    std::vector<RecordingPreamble> preamble{};
    /// A file is ended at this size; 0: never.
    std::uint64_t roll_bytes = 0;
    /// Null: the disk of the system.
    Disk* disk = nullptr;
  };
  using Parts = std::span<const std::span<const std::uint8_t>>;

  /// `folder` exists. Throws InputError: no file can be made there.
  RecordingFiles(const std::filesystem::path& folder, const Options& options);

  /// As McapFile::write_chunk(), in a new file where none is open. `first`: time of its first
  /// message, ns; `lost`: messages, so far, because of the disk. → bytes that the file grew by; 0:
  /// failed
  [[nodiscard]] std::uint64_t append(Parts parts, std::uint64_t first, std::uint64_t lost) noexcept;
  /// Ends the file where it is full; the next append() begins another.
  void roll() noexcept;
  /// Ends the last one. `time`: of a preamble that nothing followed, ns.
  void finish(std::uint64_t time) noexcept;
  /// The disk failed a moment ago, and is not to be asked again yet.
  [[nodiscard]] bool resting() const noexcept;

  /// Sentences about the disk since the last call.
  [[nodiscard]] std::vector<std::string> pop_errors();
  [[nodiscard]] std::uint64_t files() const noexcept {
    return files_.load(std::memory_order_relaxed);
  }
  /// Messages that append() had taken and the disk then did not.
  [[nodiscard]] std::uint64_t unwritten() const noexcept {
    return unwritten_.load(std::memory_order_relaxed);
  }

 private:
  struct Notice {
    enum class Kind : std::uint8_t { good_again, failed, unfinished, unwritten } kind{};
    int error = 0;           // errno
    std::uint64_t lost = 0;  // messages, so far
    int file = 0;
  };

  /// → errno; 0: open
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
  std::vector<std::uint8_t> preamble_;  // Message records
  Disk& disk_;
  McapFile file_;

  // Used by the writer's thread only.
  int number_ = 0;             // of the file at hand
  bool several_ = false;       // files have numbers
  bool preamble_due_ = false;  // of the file at hand
  bool failing_ = false;       // the last write failed
  std::int64_t retry_ns_ = 0;  // monotonic
  std::vector<char> path_, other_path_;

  std::atomic<std::uint64_t> files_{0}, unwritten_{0};
  Ring<Notice, 64> notices_;  // writer to pop_errors()
  std::mutex errors_mutex_;   // of those who take
};

}  // namespace vergence::app
