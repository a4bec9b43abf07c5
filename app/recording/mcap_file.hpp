#pragma once
#include <sys/uio.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "app/recording/cdr_writer.hpp"

namespace vergence::app {

/// Calls of the file system that fail or stall with a disk; tests simulate a full, missing or slow
/// one. Not thread-safe. Does not allocate. Returns negative errno values on errors.
class Disk {
 public:
  virtual ~Disk() = default;
  /// Creates an empty file for writing; an existing one is refused (EEXIST). Returns the
  /// descriptor.
  [[nodiscard]] virtual int create(const char* path) noexcept;
  /// Writes pieces at `offset`. Returns the number of bytes written, more than 0.
  [[nodiscard]] virtual std::int64_t write(int fd, const iovec* pieces, int count,
                                           std::uint64_t offset) noexcept;
  /// Waits for writeback and then drops the pages from the page cache, so that recording neither
  /// evicts other data nor accumulates more dirty pages than the disk can absorb. The kernel
  /// reports a writeback error only once per descriptor, so synchronise() does not repeat it.
  /// Returns 0 or -errno.
  [[nodiscard]] virtual int finish_writeback(int fd, std::uint64_t offset,
                                             std::uint64_t size) noexcept;
  /// Waits until contents and length are on the disk.
  [[nodiscard]] virtual int synchronise(int fd) noexcept;
};

/// Topic of messages: a Schema and a Channel record, both with the index in the list plus 1 as id.
struct McapTopic {
  std::string topic;
  /// Such as sensor_msgs/msg/Image.
  std::string type;
  /// Definitions of the type and of its parts, as ros2msg.
  std::string definition;
  /// YAML, offered_qos_profiles of the ros2 profile.
  std::string qos;
};

/// Head of a Message record in a queue and in a chunk.
struct McapMessageHead {
  /// Bytes of opcode u8, length u64, channel u16, sequence u32, log and publish time u64; the
  /// content follows.
  static constexpr std::size_t kSize = 31;
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  /// In ns.
  std::uint64_t log_time = 0;
  /// Size of the content in bytes.
  std::uint64_t content = 0;

  void write(std::span<std::uint8_t, kSize> out) const noexcept;
  /// Reads the head that write() wrote.
  [[nodiscard]] static McapMessageHead read(std::span<const std::uint8_t, kSize> in) noexcept;
  [[nodiscard]] std::size_t record_size() const noexcept {
    return kSize + static_cast<std::size_t>(content);
  }
};

/// MCAP file (mcap.dev, version 0, profile ros2) that grows by complete chunks: schemas and
/// channels first, uncompressed chunks with checksum and index, a summary at the end.
///
///     McapFile file(disk, topics, "vergence");
///     if (const int error = file.create("drive.mcap")) return;  // -ENOSPC …
///     McapMessageHead head{.channel = 1, .log_time = 1700000000000000000, .content = body.size()};
///     head.write(std::span(record).first<McapMessageHead::kSize>());
///     if (file.write_chunk(parts) == 0) use(file.size());  // valid up to here, whatever happens
///     if (file.finish() != 0) return;
///
/// A chunk is one write. The offset advances only after a complete write; the rest of a failed one
/// is cut off and overwritten. So the file is always valid up to the last chunk, also without a
/// summary. Allocates some 180 bytes per chunk (kMaxChunks) at construction only. Not thread-safe.
/// Returns negative errno values.
class McapFile {
 public:
  /// Chunks per file: 109 minutes of 100 ms.
  static constexpr std::size_t kMaxChunks = 65536;
  static constexpr std::size_t kMaxChannels = 32;
  /// Messages per chunk.
  static constexpr std::size_t kMaxMessages = 4096;
  static constexpr std::size_t kMaxParts = 8;

  /// Precondition: at most kMaxChannels. Topics and disk must outlive it.
  McapFile(Disk& disk, std::span<const McapTopic> topics, std::string library);
  ~McapFile();
  McapFile(const McapFile&) = delete;
  McapFile& operator=(const McapFile&) = delete;

  /// Creates a new file with its head. Precondition: none is open. Returns 0 on success.
  [[nodiscard]] int create(const char* path) noexcept;
  /// Writes at most kMaxMessages records, in pieces of complete records. Precondition: open, not
  /// full(). Returns 0 once the system has all data.
  [[nodiscard]] int write_chunk(std::span<const std::span<const std::uint8_t>> parts) noexcept;
  /// Writes index and summary, and closes the file in any case. Returns 0 if the disk has
  /// everything except what pop_unwritten() reports.
  [[nodiscard]] int finish() noexcept;
  /// Closes the file without a summary.
  void abandon() noexcept;

  [[nodiscard]] bool open() const noexcept { return fd_ >= 0; }
  /// True if the index has no room for another chunk.
  [[nodiscard]] bool full() const noexcept { return chunks_.size() == kMaxChunks; }
  /// Number of valid bytes.
  [[nodiscard]] std::uint64_t size() const noexcept { return end_; }

  /// Data accepted by the system but not written to the disk.
  struct Unwritten {
    /// First negative errno; 0: nothing is missing.
    int error = 0;
    /// Messages of the chunks that the failure may have affected.
    std::uint64_t messages = 0;
  };
  /// Failures since the last call, including those of closed files.
  [[nodiscard]] Unwritten pop_unwritten() noexcept { return std::exchange(unwritten_, {}); }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Entry {
    std::uint16_t channel = 0;
    std::uint64_t log_time = 0, offset = 0;
  };
  struct ChunkIndex {
    // In ns.
    std::uint64_t start = 0, end = 0;
    std::uint64_t offset = 0, length = 0, records = 0;
    std::uint32_t index_length = 0;
    // Position of each channel's MessageIndex relative to the chunk's end; kNone if there is none.
    std::array<std::uint32_t, kMaxChannels> index{};
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
  // Offset up to which finish_writeback() was called.
  std::uint64_t writeback_ = 0;
  // Number of messages behind that offset.
  std::uint64_t waiting_ = 0;
  Unwritten unwritten_{};
  // Entries of the current chunk.
  std::vector<Entry> entries_;
  std::vector<ChunkIndex> chunks_;
  // Number of messages by channel.
  std::array<std::uint64_t, kMaxChannels> counts_{};
  std::vector<std::uint8_t> scratch_;
};

}  // namespace vergence::app
