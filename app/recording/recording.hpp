#pragma once
#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "app/recording/mcap_file.hpp"
#include "app/recording/recording_files.hpp"
#include "app/runtime/queue_thread.hpp"
#include "core/memory/arena.hpp"
#include "core/types/time.hpp"
#include "drivers/common/wake_event.hpp"

namespace vergence::app {

/// Bounded queue of byte records between one producer thread and one consumer thread.
///
/// The memory is mapped twice in a row, so every record, and everything that waits, lies in one
/// piece: the consumer writes it to a file as it is, without a copy.
/// Threads  begin(), commit(): producer. waiting(), release(): consumer. fill(): any, a guess.
/// Memory   All at construction, present; no heap, no lock and no system call after.
/// Full     begin() refuses. A record may be asked to leave `spare` bytes free, so that large ones
///          never push out small ones.
/// Errors   The constructor throws std::system_error.
class RecordRing {
 public:
  /// `bytes` is rounded up to whole pages.
  explicit RecordRing(std::size_t bytes);
  ~RecordRing();
  RecordRing(const RecordRing&) = delete;
  RecordRing& operator=(const RecordRing&) = delete;

  /// Where a record of `size` bytes is to be written; empty: there is no room. Gone with the next
  /// begin() unless committed.
  [[nodiscard]] std::span<std::uint8_t> begin(std::size_t size, std::size_t spare) noexcept;
  /// The first `size` bytes of what begin() gave are a record.
  void commit(std::size_t size) noexcept;

  /// Everything committed and not yet released, oldest first.
  [[nodiscard]] std::span<const std::uint8_t> waiting() const noexcept;
  /// The first `size` bytes of waiting() are not needed any more.
  void release(std::size_t size) noexcept;

  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  [[nodiscard]] std::size_t fill() const noexcept {
    return static_cast<std::size_t>(tail_.load(std::memory_order_acquire) -
                                    head_.load(std::memory_order_acquire));
  }
  /// Most bytes that ever waited; exact for the producer.
  [[nodiscard]] std::size_t high_water() const noexcept {
    return high_water_.load(std::memory_order_relaxed);
  }

 private:
  std::size_t capacity_ = 0;
  std::uint8_t* memory_ = nullptr;
  // 64 bits on every machine: the place in the ring is the count modulo a capacity that is no power
  // of two, which jumps where a count wraps.
  using Count = std::uint64_t;
  [[nodiscard]] std::uint8_t* place(Count count) const noexcept {
    return memory_ + static_cast<std::size_t>(count % capacity_);
  }
  static_assert(std::atomic<Count>::is_always_lock_free);
  alignas(kCacheLine) std::atomic<Count> head_{0};  // bytes released since the start
  alignas(kCacheLine) std::atomic<Count> tail_{0};  // bytes committed since the start
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
  /// Capacity of all queues, and the sum of the maxima that waited in each.
  std::size_t queue_bytes = 0, queue_high_water = 0;
};

/// Messages into MCAP files `drive.mcap` on a thread of its own: who posts never waits for a disk.
///
///     Recording recording("sessions/monday", options);
///     if (const auto room = recording.begin(0, kPose, stamp, 500); !room.empty())
///       recording.commit(0, encode(sample, room));  // bytes written; 0: none after all
///     recording.close();
///
/// Queues     One for each producer thread. What is posted lies there as it will lie in the file;
///            the thread takes all that waits every 20 ms and writes it as a chunk when its oldest
///            message has waited 40 ms. So a process that is killed loses the last 100 ms at most.
/// Files      Split by size and when the index is full: drive.mcap becomes drive_0.mcap, the next
///            is drive_1.mcap. Every file begins with all schemas, channels and the preamble.
/// Threads    begin(), commit(): one thread a queue. pop_errors(), counters(): any, counters exact
///            after close(). close(): the owner's, after the last commit().
/// Memory     All at construction; the writer's thread is sealed.
/// Full       drop: begin() refuses, counted; large messages leave room for the rest. wait: begin()
///            waits for room (virtual time, replay).
/// Errors     The constructor throws InputError (folder, disk) and std::system_error (memory). When
///            a write fails the data wait in their queue while there is room and the same file is
///            tried again every RecordingFiles::kRetry; messages by pop_errors().
class Recording {
 public:
  struct Options {
    RecordingFiles::Options files{};
    /// Capacity of each queue, bytes.
    std::vector<std::size_t> queues;
    /// Stamp of the preamble if no message follows.
    Stamp start{};
    WhenFull when_full = WhenFull::drop;
  };

  /// `folder` exists.
  Recording(const std::filesystem::path& folder, const Options& options);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  /// Where a message of at most `most` bytes is to be written; empty: dropped and counted. `bulky`:
  /// an image, which leaves room for a thousand small messages.
  [[nodiscard]] std::span<std::uint8_t> begin(std::size_t queue, std::size_t topic, Stamp stamp,
                                              std::size_t most, bool bulky = false) noexcept;
  /// The first `size` bytes of what begin() gave are the message. 0: there is none after all.
  void commit(std::size_t queue, std::size_t size) noexcept;

  /// Sentences about the disk since the last call.
  [[nodiscard]] std::vector<std::string> pop_errors() { return files_.pop_errors(); }
  [[nodiscard]] RecordingCounters counters() const noexcept;
  /// Writes what waits, ends the file. Once.
  void close() noexcept;

 private:
  /// A producer's: only its thread touches what is no ring.
  struct Queue {
    explicit Queue(std::size_t bytes) : ring(bytes) {}
    RecordRing ring;
    McapMessageHead head{};
    std::span<std::uint8_t> open{};  // head and content
  };
  /// Pending messages, up to the size of a chunk.
  struct Batch {
    std::array<std::span<const std::uint8_t>, McapFile::kMaxParts> parts{};
    std::size_t messages = 0, bytes = 0;
    std::uint64_t first = 0;  // time of the first one, ns
    bool filled = false;      // there is more than a chunk takes
  };

  /// RecordingCounters as they grow.
  struct Counts {
    std::atomic<std::uint64_t> messages{0}, bytes{0}, chunks{0};
    std::atomic<std::uint64_t> dropped{0}, dropped_images{0}, lost{0};
  };

  void work() noexcept;
  /// at_once: however young what waits is. last: what cannot be stored now is lost.
  void drain(bool at_once, bool last) noexcept;
  [[nodiscard]] Batch gather() const noexcept;
  [[nodiscard]] bool due(const Batch& batch) noexcept;
  void release(const Batch& batch) noexcept;
  void make_room(bool hurried) noexcept;
  void drop_oldest(RecordRing* ring) noexcept;
  [[nodiscard]] bool store(const Batch& batch) noexcept;

  const Options options_;
  std::vector<std::uint32_t> sequences_;  // by topic; of its producer
  std::vector<std::unique_ptr<Queue>> queues_;
  RecordingFiles files_;
  std::int64_t waiting_since_ns_ = 0;  // monotonic; of the writer's thread

  Counts counts_;
  std::mutex mutex_;  // with stop_ and hurry_, for the writer that sleeps
  std::condition_variable wake_;
  bool stop_ = false, hurry_ = false;
  WakeEvent freed_;
  std::thread thread_;
};

}  // namespace vergence::app
