#pragma once
#include <climits>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>

#include "app/recording/mcap_file.hpp"
#include "app/recording/messages.hpp"
#include "app/runtime/queue_thread.hpp"

namespace vergence::app {

/// Bounded queue of byte records between one producer and one consumer thread.
///
/// The memory is mapped twice in a row, so all waiting records are contiguous and the consumer
/// writes them without a copy.
/// Threads  The producer calls begin() and commit(), the consumer waiting() and release(). fill()
///          is thread-safe but approximate.
/// Memory   Allocated and resident at construction; no heap, lock or system call afterwards.
/// Full     begin() refuses. A record can leave `spare` bytes free, so that large ones do not
///          displace small ones.
/// Errors   The constructor throws std::system_error.
class RecordRing {
 public:
  /// `bytes` is rounded up to whole pages.
  explicit RecordRing(std::size_t bytes);
  ~RecordRing();

  /// Memory for a record of `size` bytes; empty if there is no room. Invalid after the next begin()
  /// unless committed.
  [[nodiscard]] std::span<std::uint8_t> begin(std::size_t size, std::size_t spare) noexcept;
  /// Makes the first `size` bytes of begin() a record.
  void commit(std::size_t size) noexcept;

  /// All committed and unreleased records, oldest first.
  [[nodiscard]] std::span<const std::uint8_t> waiting() const noexcept;
  /// Releases the first `size` bytes of waiting().
  void release(std::size_t size) noexcept {
    head_.store(head_.load(std::memory_order_relaxed) + size, std::memory_order_release);
  }

  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  [[nodiscard]] std::size_t fill() const noexcept {
    return static_cast<std::size_t>(tail_.load(std::memory_order_acquire) -
                                    head_.load(std::memory_order_acquire));
  }
  /// Maximum number of waiting bytes; exact for the producer.
  [[nodiscard]] std::size_t high_water() const noexcept {
    return high_water_.load(std::memory_order_relaxed);
  }

 private:
  std::size_t capacity_ = 0;
  std::uint8_t* memory_ = nullptr;
  // 64 bits on every machine: the position is the count modulo a capacity that is no power of two,
  // which would jump when a count wraps.
  using Count = std::uint64_t;
  [[nodiscard]] std::uint8_t* place(Count count) const noexcept {
    return memory_ + static_cast<std::size_t>(count % capacity_);
  }
  static_assert(std::atomic<Count>::is_always_lock_free);
  // Number of bytes released since the start.
  alignas(kCacheLine) std::atomic<Count> head_{0};
  // Number of bytes committed since the start.
  alignas(kCacheLine) std::atomic<Count> tail_{0};
  std::atomic<std::size_t> high_water_{0};
};

/// Counters; exact after close().
struct RecordingCounters {
  /// Messages and bytes written to files.
  std::uint64_t messages = 0, bytes = 0;
  std::uint64_t chunks = 0, files = 0;
  /// Messages that did not fit into their queue.
  std::uint64_t dropped = 0;
  /// Dropped messages of large topics.
  std::uint64_t dropped_images = 0;
  /// Messages that waited for a failing disk until the queue was full, or that the disk accepted
  /// and lost.
  std::uint64_t lost = 0;
  /// Capacity of all queues, and the sum of their maximum fills.
  std::size_t queue_bytes = 0, queue_high_water = 0;
};

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

/// Writes messages to MCAP files `drive.mcap` on its own thread, so that producers never wait for a
/// disk.
///
///     Recording recording("sessions/monday", options);
///     if (const auto room = recording.begin(0, kPose, stamp, 500); !room.empty())
///       recording.commit(0, encode(sample, room));  // bytes written; 0 cancels
///     recording.close();
///
/// Queues     One per producer thread, in the format of the file. Every 20 ms the thread looks for
///            data, and writes a chunk once the oldest message is 40 ms old. A killed process thus
///            loses at most the last 100 ms.
/// Files      Split by size and when the index is full: drive.mcap becomes drive_0.mcap, followed
///            by drive_1.mcap. Every file begins with all schemas, channels and the preamble.
/// Threads    One thread per queue calls begin() and commit(), the owner close() after the last
///            commit(), and pop_errors(). counters() is thread-safe, and exact after close().
/// Memory     Allocated at construction; the writer's thread is sealed.
/// Full       drop: begin() refuses and counts; large messages leave room for small ones. wait:
///            begin() waits for room (virtual time, replay).
/// Errors     The constructor throws InputError (directory, disk) and std::system_error (memory).
///            After a failed write the data wait in their queue while there is room, and the file
///            is retried every kRetry; pop_errors() has the messages.
class Recording {
 public:
  static constexpr Duration kRetry = Duration::seconds(3);
  struct Options {
    std::vector<RecordedTopic> topics;
    std::vector<RecordingPreamble> preamble{};
    /// A file is ended at this size; 0 disables this.
    std::uint64_t roll_bytes = 0;
    /// Capacity of each queue, bytes.
    std::vector<std::size_t> queues;
    /// Stamp of the preamble if no message follows.
    Stamp start{};
    WhenFull when_full = WhenFull::drop;
    /// Null selects the disk of the system.
    Disk* disk = nullptr;
  };

  /// `folder` must exist.
  Recording(const std::filesystem::path& folder, const Options& options);
  ~Recording();

  /// Memory for a message of at most `most` bytes; empty if it is dropped, which is counted.
  /// `bulky` marks an image, which leaves room for a thousand small messages.
  [[nodiscard]] std::span<std::uint8_t> begin(std::size_t queue, std::size_t topic, Stamp stamp,
                                              std::size_t most, bool bulky = false) noexcept;
  /// Makes the first `size` bytes of begin() the message; 0 cancels it.
  void commit(std::size_t queue, std::size_t size) noexcept;

  /// Messages about the disk since the last call.
  [[nodiscard]] std::vector<std::string> pop_errors();
  [[nodiscard]] RecordingCounters counters() const noexcept;
  /// Writes the remaining messages and ends the file. Call once.
  void close() noexcept;

 private:
  /// Queue of a producer; only its thread uses members other than the ring.
  struct Queue {
    explicit Queue(std::size_t bytes) : ring(bytes) {}
    RecordRing ring;
    McapMessageHead head{};
    // Head and content.
    std::span<std::uint8_t> open{};
  };
  /// Pending messages, up to the size of a chunk.
  struct Batch {
    std::array<std::span<const std::uint8_t>, McapFile::kMaxParts> parts{};
    std::size_t messages = 0, bytes = 0;
    // Time of the first message, in ns.
    std::uint64_t first = 0;
    // True if there is more than a chunk holds.
    bool filled = false;
  };

  /// Live values of RecordingCounters.
  struct Counts {
    std::atomic<std::uint64_t> messages{0}, bytes{0}, chunks{0};
    std::atomic<std::uint64_t> dropped{0}, dropped_images{0}, lost{0}, files{0};
  };
  /// Message about the disk.
  struct Notice {
    enum class Kind : std::uint8_t { good_again, failed, unfinished, unwritten } kind{};
    // Value of errno.
    int error = 0;
    // Number of lost messages so far.
    std::uint64_t lost = 0;
    int file = 0;
  };

  void work() noexcept;
  /// With `at_once` even new data are written. With `last` data that cannot be stored are lost.
  void drain(bool at_once, bool last) noexcept;
  [[nodiscard]] Batch gather() const noexcept;
  [[nodiscard]] bool due(const Batch& batch) noexcept;
  void release(const Batch& batch) noexcept;
  void make_room(bool hurried) noexcept;
  void drop_oldest(RecordRing* ring) noexcept;
  [[nodiscard]] bool store(const Batch& batch) noexcept;
  /// Opens a file. Returns 0 or an error.
  [[nodiscard]] int open_file() noexcept;
  [[nodiscard]] int write_preamble(std::uint64_t time) noexcept;
  void fail(int error) noexcept;
  void end_file() noexcept;
  void begin_next_file() noexcept;
  void record_unwritten() noexcept;
  [[nodiscard]] std::array<char, PATH_MAX> path() const noexcept;
  [[nodiscard]] std::string message(const Notice& notice) const;

  const Options options_;
  // Sequence numbers by topic, used by its producer.
  std::vector<std::uint32_t> sequences_;
  std::vector<std::unique_ptr<Queue>> queues_;
  const std::string folder_;
  const std::vector<McapTopic> topics_;
  Disk disk_of_system_;
  Disk& disk_;

  // Used by the writer's thread only.

  // Contains Message records.
  std::vector<std::uint8_t> preamble_;
  McapFile file_;
  // Monotonic time.
  std::int64_t waiting_since_ns_ = 0;
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
  // Passed from the writer to pop_errors().
  Ring<Notice, 64> notices_;

  Counts counts_;
  // Guards stop_ and hurry_ while the writer sleeps.
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false, hurry_ = false;
  WakeEvent freed_;
  std::thread thread_;
};

}  // namespace vergence::app
