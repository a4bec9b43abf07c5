#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// Messages out of MCAP files (mcap.dev, specification version 0), front to back; neither index nor
/// summary is believed or needed.
namespace vergence::app::detail {

inline constexpr std::uint64_t kMostChunk =
    std::uint64_t{64} << 20U;  // bytes, packed or unpacked: rosbag2 writes less than 1 MiB
inline constexpr std::uint64_t kMostDescription = std::uint64_t{1}
                                                  << 20;  // bytes of a Schema or Channel record

/// Bytes that are read by position. Threads  read() from any number at once.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const noexcept = 0;
  /// All of `out` from `offset`. False: they are not all there, or cannot be read; content of `out`
  /// undefined.
  [[nodiscard]] virtual bool read(std::uint64_t offset,
                                  std::span<std::uint8_t> out) const noexcept = 0;
};

class FileBytes final : public ByteSource {
 public:
  /// InputError: no such file, no regular file, or it cannot be opened.
  explicit FileBytes(const std::filesystem::path& file);
  ~FileBytes() override;
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;
  [[nodiscard]] std::uint64_t size() const noexcept override { return size_; }
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

/// A view; the bytes outlive it.
class MemoryBytes final : public ByteSource {
 public:
  explicit MemoryBytes(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const noexcept override { return bytes_.size(); }
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;

 private:
  std::span<const std::uint8_t> bytes_;
};

struct McapChannel {
  std::string topic;
  std::string type;      // the schema's name: sensor_msgs/msg/Image
  std::string encoding;  // cdr
};

/// Where a message's content is.
struct McapPlace {
  static constexpr std::uint64_t kNoChunk = 0;
  std::uint64_t chunk = kNoChunk;  // offset of a packed Chunk record in the file; kNoChunk:
                                   // `offset` counts from the file's start
  std::uint64_t offset = 0;        // of the message's content, in the unpacked records of the chunk
  std::uint32_t size = 0;          // bytes of the content
};

struct McapMessage {
  const McapChannel* channel = nullptr;  // until the scan ends
  std::uint64_t log_time = 0;            // ns
  McapPlace place{};
  const ByteSource* bytes = nullptr;  // where place.offset counts; during the call
};

/// What a scan met.
struct McapScan {
  std::uint64_t messages = 0;
  std::uint64_t orphans = 0;  // messages of no channel that was described before them
  std::uint64_t broken_chunks =
      0;  // do not unpack, fail their check sum, or are larger than kMostChunk: skipped
  std::uint64_t broken_records =
      0;  // descriptions that contradict themselves, messages shorter than their head: skipped
  std::optional<std::uint64_t> first_broken{};  // offset in the file of the first of these
  std::string why_broken{};                     // and what is wrong with it: a phrase
  bool finished = false;                        // DataEnd or Footer was met
  std::uint64_t end = 0;                        // offset behind the last whole record
};

/// Hands every message to `each`, in the file's order; content that is not all there is not
/// handed over. Chunks without compression are
/// read where they lie, 9 bytes a record and 22 a message, whatever their length; their check sums
/// are not looked at. Memory  Two times kMostChunk at most.  InputError  The file does not begin as
/// MCAP.
[[nodiscard]] McapScan scan_mcap(const FileBytes& file,
                                 const std::function<void(const McapMessage&)>& each);

/// Unpacks the chunk at `offset` of the file into *records. False: it is not as the scan found it;
/// *records undefined.
[[nodiscard]] bool unpack_chunk(const FileBytes& file, std::uint64_t offset,
                                std::vector<std::uint8_t>* records);

/// The frame or frames of `packed` as `name` says ("zstd", "lz4"), exactly `records->size()` bytes.
/// False: they are not.
[[nodiscard]] bool decompress(const std::string& name, std::span<const std::uint8_t> packed,
                              std::span<std::uint8_t> records) noexcept;

}  // namespace vergence::app::detail
