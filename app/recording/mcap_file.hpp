#pragma once
#include <sys/uio.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/recording/cdr_writer.hpp"

namespace vergence::app {

/// File-system interface of a recording; tests put a full, missing or slow disk in its
/// place.
///
/// Threads  One. Memory  None. Errors  Negative errno values; nothing throws.
class Disk {
 public:
  virtual ~Disk() = default;
  /// A new, empty file for writing; one of that name is refused (EEXIST). → descriptor
  [[nodiscard]] virtual int create(const char* path) noexcept = 0;
  /// Some of the pieces at `offset` of the file. → bytes written, more than 0
  [[nodiscard]] virtual std::int64_t write(int fd, const iovec* pieces, int count,
                                           std::uint64_t offset) noexcept = 0;
  [[nodiscard]] virtual int truncate(int fd, std::uint64_t size) noexcept = 0;
  /// Bytes of the file begin their way to the disk.
  virtual void start_writeback(int fd, std::uint64_t offset, std::uint64_t size) noexcept = 0;
  /// Waits until bytes are with the disk, and lets the system forget them: pages that nobody reads
  /// do not push out those that somebody does, and never more wait than the disk takes at once. The
  /// system tells a descriptor of a failed writeback once: synchronise() does not repeat it. → 0
  [[nodiscard]] virtual int finish_writeback(int fd, std::uint64_t offset,
                                             std::uint64_t size) noexcept = 0;
  /// Contents and length are on the disk.
  [[nodiscard]] virtual int synchronise(int fd) noexcept = 0;
  virtual void close(int fd) noexcept = 0;
  [[nodiscard]] virtual int rename(const char* from, const char* to) noexcept = 0;
  virtual void remove(const char* path) noexcept = 0;
};

/// The system's.
[[nodiscard]] Disk& system_disk() noexcept;

/// Type of messages: a Schema and a Channel record, the ids of both its place in the list
/// plus 1.
struct McapTopic {
  std::string topic;
  std::string type;        // sensor_msgs/msg/Image
  std::string definition;  // of the type and of all that it is made of, ros2msg
  std::string qos;         // offered_qos_profiles of the ros2 profile; YAML
};

/// The head of a Message record, as it stands in a queue and in a chunk.
struct McapMessageHead {
  static constexpr std::size_t kSize = 31;  // opcode u8, length u64, channel u16, sequence u32, log
                                            // and publish time u64; the content follows
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0;  // ns
  std::uint64_t content = 0;   // bytes

  void write(std::span<std::uint8_t, kSize> out) const noexcept;
  /// Reads the head of a record that write() began.
  [[nodiscard]] static McapMessageHead read(std::span<const std::uint8_t, kSize> in) noexcept;
  [[nodiscard]] std::size_t record_size() const noexcept {
    return kSize + static_cast<std::size_t>(content);
  }
};

/// One MCAP file (mcap.dev, version 0, profile ros2) that grows by whole chunks: schemas and
/// channels first, chunks that are not packed with their check sum and index, a summary at the end.
///
///     McapFile file(disk, topics, "vergence");
///     if (const int error = file.create("drive.mcap")) return;  // -ENOSPC …
///     McapMessageHead head{.channel = 1, .log_time = 1700000000000000000, .content = body.size()};
///     head.write(std::span(record).first<McapMessageHead::kSize>());
///     if (file.write_chunk(parts) == 0) use(file.size());  // good up to here, whatever happens
///     if (file.finish() != 0) return;
///
/// A chunk is one write, at an offset that only moves when all of it was taken; what a failed write
/// left behind is cut off and written over. So the file is always good up to the last chunk, also
/// without its end.
/// Threads  One. Memory  Some 180 bytes for each of kMaxChunks, at construction; none after.
/// Errors   Negative errno values.
class McapFile {
 public:
  static constexpr std::size_t kMaxChunks = 65536;  // in a file: 109 minutes of 100 ms
  static constexpr std::size_t kMaxChannels = 32;
  static constexpr std::size_t kMaxMessages = 4096;  // in a chunk
  static constexpr std::size_t kMaxParts = 8;

  /// Precondition: at most kMaxChannels. Topics and disk outlive it.
  McapFile(Disk& disk, std::span<const McapTopic> topics, std::string library);
  ~McapFile();
  McapFile(const McapFile&) = delete;
  McapFile& operator=(const McapFile&) = delete;

  /// A new file with its head. Precondition: none is open. → 0
  [[nodiscard]] int create(const char* path) noexcept;
  /// Message records, of at most kMaxMessages, in pieces that are whole records. Precondition:
  /// open, not full(). → 0, and then all of it is with the system
  [[nodiscard]] int write_chunk(std::span<const std::span<const std::uint8_t>> parts) noexcept;
  /// Index and summary; the file is closed whatever comes of them. → 0, and then the disk has all
  /// but what pop_unwritten() names
  [[nodiscard]] int finish() noexcept;
  /// Closed as it is: without an end.
  void abandon() noexcept;

  [[nodiscard]] bool open() const noexcept { return fd_ >= 0; }
  /// The index has no room for another chunk.
  [[nodiscard]] bool full() const noexcept { return chunks_.size() == kMaxChunks; }
  [[nodiscard]] std::uint64_t size() const noexcept { return end_; }  // bytes that are good

  /// Data accepted by the system and then not written to the disk.
  struct Unwritten {
    int error = 0;               // negative errno, the first one; 0: nothing is missing
    std::uint64_t messages = 0;  // of the chunks that the failure may have touched
  };
  /// Since the last call, of files that are closed meanwhile, too.
  [[nodiscard]] Unwritten pop_unwritten() noexcept { return std::exchange(unwritten_, {}); }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Entry {
    std::uint16_t channel = 0;
    std::uint64_t log_time = 0, offset = 0;
  };
  struct ChunkIndex {
    std::uint64_t start = 0, end = 0;  // ns
    std::uint64_t offset = 0, length = 0, records = 0;
    std::uint32_t index_length = 0;
    std::array<std::uint32_t, kMaxChannels> index{};  // of each channel's MessageIndex, from the
                                                      // chunk's end; kNone
  };
  class Appender;

  [[nodiscard]] int append(iovec* pieces, int count) noexcept;
  void write_back(const ChunkIndex& chunk) noexcept;
  void record_unwritten(int error) noexcept;
  void index_messages(std::span<const std::span<const std::uint8_t>> parts, ChunkIndex* chunk,
                      std::uint32_t* crc) noexcept;
  void write_schemas(Appender* out) const noexcept;
  void write_channels(Appender* out) const noexcept;
  void write_chunk_indexes(Appender* out) const noexcept;
  void write_statistics(Appender* out) const noexcept;

  Disk& disk_;
  std::span<const McapTopic> topics_;
  std::string library_;
  int fd_ = -1;
  std::uint64_t end_ = 0, first_ = 0, last_ = 0;
  std::uint64_t writeback_ = 0;  // offset up to which finish_writeback() was asked for
  std::uint64_t waiting_ = 0;    // messages behind it
  Unwritten unwritten_{};
  std::vector<Entry> entries_;  // of the chunk at hand
  std::vector<ChunkIndex> chunks_;
  std::array<std::uint64_t, kMaxChannels> counts_{};  // messages of each channel
  std::vector<std::uint8_t> scratch_;
};

}  // namespace vergence::app
