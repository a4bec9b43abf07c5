#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Reads messages of ROS recordings in any container front to back; indexes and summaries are not
/// used.
namespace vergence::app::detail {

/// Bytes with random access. read() is thread-safe.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const noexcept = 0;
  /// Fills `out` from `offset`. Returns false, with `out` undefined, if that fails.
  [[nodiscard]] virtual bool read(std::uint64_t offset,
                                  std::span<std::uint8_t> out) const noexcept = 0;
};

/// File among more than a process may have open: each thread keeps only its last file open.
class FileBytes final : public ByteSource {
 public:
  /// Throws InputError if the file is missing, not regular or cannot be opened.
  explicit FileBytes(const std::filesystem::path& file);
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;
  [[nodiscard]] std::uint64_t size() const noexcept override { return size_; }
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  // Unique in the process.
  std::uint64_t number_;
  std::uint64_t size_ = 0;
};

/// View of bytes, which must outlive it.
class MemoryBytes final : public ByteSource {
 public:
  explicit MemoryBytes(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const noexcept override { return bytes_.size(); }
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;

 private:
  std::span<const std::uint8_t> bytes_;
};

/// In bytes, packed or unpacked; rosbag and rosbag2 write less than 1 MiB.
inline constexpr std::uint64_t kMaxChunk = std::uint64_t{64} << 20U;
/// Maximum size of a channel description, in bytes.
inline constexpr std::uint64_t kMaxDescription = std::uint64_t{1} << 20;
/// Maximum length of a topic's or type's name, in bytes.
inline constexpr std::size_t kMaxName = 1024;
/// Maximum number per file.
inline constexpr std::size_t kMaxChannels = 65536;

enum class BagFormat : std::uint8_t { mcap, rosbag, sqlite };

/// Serialisation of a channel's messages: CDR (ROS 2), ROS 1, or one that is not supported.
enum class MessageEncoding : std::uint8_t { cdr, ros1, other };

struct BagChannel {
  std::string topic;
  /// In ROS 1's form: sensor_msgs/Image.
  std::string type;
  MessageEncoding encoding = MessageEncoding::other;
};

/// Name of the type in ROS 1's form: without the /msg/ of ROS 2.
[[nodiscard]] std::string plain_type(std::string_view type);

/// Position of a message's content.
struct BagPlace {
  static constexpr std::uint64_t kNoChunk = 0;
  /// Offset of a packed chunk's record in the file; with kNoChunk `offset` is in the file.
  std::uint64_t chunk = kNoChunk;
  /// Offset of the content, in the unpacked records of the chunk.
  std::uint64_t offset = 0;
  /// Size of the content in bytes.
  std::uint32_t size = 0;
};

struct BagMessage {
  /// Valid until the scan ends.
  const BagChannel* channel = nullptr;
  BagPlace place{};
  /// Source to which place.offset refers; valid during the call.
  const ByteSource* bytes = nullptr;
  /// Recording time in ns.
  std::int64_t log_time = 0;
};

/// First `most` bytes of a message's content, or all; empty if unreadable.
[[nodiscard]] std::vector<std::uint8_t> first_bytes(const BagMessage& message, std::size_t most);

using BagVisitor = std::function<void(const BagMessage&)>;

/// Result of a scan.
struct BagScan {
  std::uint64_t messages = 0;
  /// Messages of a channel that was not described before.
  std::uint64_t orphans = 0;
  /// Skipped chunks and records: not unpackable, wrong checksum, larger than kMaxChunk,
  /// contradicting descriptions.
  std::uint64_t skipped = 0;
  /// Offset of the first of these in the file.
  std::optional<std::uint64_t> first_broken{};
  /// Phrase about its problem.
  std::string why_broken{};
  /// True if the writer closed the file.
  bool finished = false;
  /// Offset after the last complete record.
  std::uint64_t end = 0;

  /// Counts a skipped chunk or record.
  void skip(std::uint64_t offset, std::string_view why);
  /// Adds a remark about missing data of the file with this name.
  void remark(const std::string& name, std::vector<std::string>* remarks) const;
};

/// Passes every message to `each`, in the file's order (sqlite: by log time), except incomplete
/// ones. Of uncompressed chunks only message headers are read. Returns nothing if the file does not
/// begin as the format requires. Precondition: of sqlite one of open_sqlite_bag(). Uses at most two
/// times kMaxChunk, and kMaxChannels names.
[[nodiscard]] std::optional<BagScan> scan_bag(BagFormat format, const ByteSource& file,
                                              const BagVisitor& each);

/// Unpacks the chunk at `offset` of the file into *records. Returns false, with *records undefined,
/// if it has changed since the scan.
[[nodiscard]] bool unpack_chunk(BagFormat format, const ByteSource& file, std::uint64_t offset,
                                std::vector<std::uint8_t>* records);

// Container-specific parts of scan_bag() and unpack_chunk().
//
// MCAP (mcap.dev, specification version 0). Of uncompressed chunks 9 bytes per record and 22 per
// message are read; their checksums are ignored.
[[nodiscard]] std::optional<BagScan> scan_mcap(const ByteSource& file, const BagVisitor& each);
[[nodiscard]] bool unpack_mcap_chunk(const ByteSource& file, std::uint64_t offset,
                                     std::vector<std::uint8_t>* records);

// ROS 1 bags (wiki.ros.org/Bags/Format/2.0); index records are skipped. A chunk that its recorder
// never closed claims to be empty, and its records follow; if uncompressed, they are read like
// others of the file.
[[nodiscard]] std::optional<BagScan> scan_rosbag(const ByteSource& file, const BagVisitor& each);
[[nodiscard]] bool unpack_rosbag_chunk(const ByteSource& file, std::uint64_t offset,
                                       std::vector<std::uint8_t>* records);

// ROS 2 bags in an SQLite file (.db3), opened read-only, with a write-ahead log (-wal) next to it.
// A message's bytes have the offset row number · 2^32, so that code which reads files by offset can
// read them. Opening throws InputError if the file is missing or SQLite cannot open it.
[[nodiscard]] std::unique_ptr<const ByteSource> open_sqlite_bag(const std::filesystem::path& file);
[[nodiscard]] std::optional<BagScan> scan_sqlite(const ByteSource& file, const BagVisitor& each);

}  // namespace vergence::app::detail
