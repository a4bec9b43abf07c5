#pragma once
#include <map>

#include "app/datasets/detail/bag_scan.hpp"

/// Common part of containers whose records may be in chunks.
namespace vergence::app::detail {

/// Records of a chunk in a file.
struct Chunk {
  /// Empty: not compressed.
  std::string compression{};
  /// Offset and size in the file, and size of the unpacked records.
  std::uint64_t offset = 0, size = 0, unpacked = 0;
  /// Checksum of the unpacked records; 0 if there is none.
  std::uint32_t crc = 0;
};

/// Unpacks a compressed chunk into *records. Returns a phrase about the problem; empty on success.
[[nodiscard]] std::string unpack(const ByteSource& file, const Chunk& chunk,
                                 std::vector<std::uint8_t>* records);

/// Scan of one file. `Record` has the offset `content` and the `size` of a record's content.
template <class Record>
class RecordScanner {
 protected:
  /// Returns the record at an offset; empty if it is incomplete.
  using RecordAt = std::optional<Record> (*)(const ByteSource& bytes, std::uint64_t offset);

  RecordScanner(const ByteSource& file, const BagVisitor& each, RecordAt record_at)
      : file_(file), each_(each), record_at_(record_at) {}
  ~RecordScanner() = default;

  /// Reads a record that is no chunk. `chunk` is as in BagPlace, `here` the offset for messages.
  virtual void read_record(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                           std::uint64_t here) = 0;

  void read_chunk(const Chunk& chunk, std::uint64_t here) {
    if (chunk.compression.empty())
      return read_records(file_, chunk.offset, chunk.offset + chunk.size, BagPlace::kNoChunk, here);
    if (const std::string why = unpack(file_, chunk, &records_); !why.empty())
      return scan_.skip(here, why);
    read_records(MemoryBytes(records_), 0, records_.size(), here, here);
  }

  /// Content of a record that describes a channel; empty, with the record skipped, if unreadable.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> description(const ByteSource& bytes,
                                                                     const Record& record,
                                                                     std::uint64_t here) {
    std::vector<std::uint8_t> content(
        static_cast<std::size_t>(std::min<std::uint64_t>(record.size, kMaxDescription + 1)));
    if (content.size() <= kMaxDescription && bytes.read(record.content, content)) return content;
    scan_.skip(here, "a description longer than 1 MiB or unreadable");
    return std::nullopt;
  }

  /// Passes a message on if its channel is described.
  void pass(std::uint32_t channel, const ByteSource& bytes, const BagPlace& place,
            std::int64_t log_time) {
    const auto found = channels_.find(channel);
    ++(found == channels_.end() ? scan_.orphans : scan_.messages);
    if (found != channels_.end()) each_({&found->second, place, &bytes, log_time});
  }

  const ByteSource& file_;
  BagScan scan_;
  std::map<std::uint32_t, BagChannel> channels_;

 private:
  void read_records(const ByteSource& bytes, std::uint64_t at, std::uint64_t end,
                    std::uint64_t chunk, std::uint64_t here) {
    while (at < end) {
      const auto record = record_at_(bytes, at);
      if (!record || record->content + record->size > end)
        return scan_.skip(here, "a chunk whose records do not fill it");
      read_record(bytes, *record, chunk, here);
      at = record->content + record->size;
    }
  }

  const BagVisitor& each_;
  RecordAt record_at_;
  // Unpacked records of the current chunk.
  std::vector<std::uint8_t> records_;
};

}  // namespace vergence::app::detail
