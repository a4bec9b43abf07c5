#include "app/datasets/detail/bag_scan.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <map>

#include "app/datasets/detail/little_endian.hpp"

namespace vergence::app::detail {
namespace {

constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};
// Opcode u8, length u64.
constexpr std::uint64_t kRecordHead = 9;
// Channel u16, sequence u32, log time and publish time u64.
constexpr std::uint64_t kMessageHead = 22;
// Start, end and unpacked size u64, checksum u32, length of the compression's name u32.
constexpr std::uint64_t kChunkHead = 32;
// Maximum length of a compression's name, in bytes.
constexpr std::uint64_t kMaxCompression = 16;

enum class Opcode : std::uint8_t {
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  data_end = 15
};

struct Record {
  Opcode opcode{};
  // Offset of the content.
  std::uint64_t content = 0;
  // Size of the content in bytes.
  std::uint64_t size = 0;
};

/// The record at `offset`; nothing: it is not all there.
std::optional<Record> record_at(const ByteSource& bytes, std::uint64_t offset) noexcept {
  std::array<std::uint8_t, kRecordHead> head{};
  if (!bytes.read(offset, head) || head[0] == 0) return std::nullopt;
  Record record{static_cast<Opcode>(head[0]), offset + kRecordHead,
                LittleEndian(std::span(head).subspan(1)).u64()};
  if (record.size > bytes.size() - record.content) return std::nullopt;
  return record;
}

/// Head of a chunk's records.
struct ChunkHead {
  std::uint64_t unpacked = 0;
  // Checksum of the unpacked records; 0 if there is none.
  std::uint32_t crc = 0;
  std::string compression;
  // Offset of the records in the file.
  std::uint64_t records = 0;
  // Size of the records in the file, in bytes.
  std::uint64_t packed = 0;
};

std::optional<ChunkHead> chunk_head(const ByteSource& file, const Record& record) {
  std::array<std::uint8_t, kChunkHead + kMaxCompression + 8> bytes{};
  const auto there = std::span(bytes).first(
      static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), record.size)));
  if (!file.read(record.content, there) || there.size() < kChunkHead) return std::nullopt;
  LittleEndian in(there.subspan(16));
  ChunkHead head;
  head.unpacked = in.u64();
  head.crc = in.u32();
  head.compression = in.text();
  head.packed = in.u64();
  head.records = record.content + kChunkHead + head.compression.size() + 8;
  if (!in.ok() || head.packed > record.content + record.size - head.records) return std::nullopt;
  return head;
}

/// Why a chunk cannot be unpacked; empty: it is in *records.
std::string unpack(const ByteSource& file, const ChunkHead& head,
                   std::vector<std::uint8_t>* records) {
  if (head.packed > kMaxChunk || head.unpacked > kMaxChunk)
    return "a chunk larger than 64 MiB; write the bag with smaller chunks";
  std::vector<std::uint8_t> packed(static_cast<std::size_t>(head.packed));
  if (!file.read(head.records, packed)) return "a chunk that cannot be read";
  records->resize(static_cast<std::size_t>(head.unpacked));
  if (head.compression != "zstd" && head.compression != "lz4")
    return "a chunk of the compression \"" + head.compression +
           "\"; lz4, zstd and none can be read";
  if (!decompress(head.compression, packed, *records))
    return "a chunk whose " + head.compression + " data do not unpack";
  if (head.crc != 0 && libdeflate_crc32(0, records->data(), records->size()) != head.crc)
    return "a chunk whose check sum fails";
  return "";
}

MessageEncoding to_encoding(const std::string& name) {
  return name == "cdr"    ? MessageEncoding::cdr
         : name == "ros1" ? MessageEncoding::ros1
                          : MessageEncoding::other;
}

/// One scan of one file.
class Scanner {
 public:
  Scanner(const ByteSource& file, const BagVisitor& each) : file_(file), each_(each) {}

  BagScan scan() {
    std::uint64_t at = kMagic.size();
    scan_.end = at;
    while (const auto record = record_at(file_, at)) {
      at = record->content + record->size;
      scan_.end = at;
      if (record->opcode == Opcode::data_end || record->opcode == Opcode::footer) {
        scan_.finished = true;
        break;
      }
      if (record->opcode == Opcode::chunk)
        read_chunk(*record);
      else
        read_record(file_, *record, BagPlace::kNoChunk, record->content - kRecordHead);
    }
    return std::move(scan_);
  }

 private:
  void read_chunk(const Record& record) {
    const std::uint64_t here = record.content - kRecordHead;
    const auto head = chunk_head(file_, record);
    if (!head)
      return scan_.broken(&BagScan::broken_chunks, here,
                          "a chunk whose head contradicts its length");
    if (head->compression.empty()) {
      walk(file_, head->records, head->records + head->packed, BagPlace::kNoChunk, here);
      return;
    }
    if (const std::string why = unpack(file_, *head, &records_); !why.empty())
      return scan_.broken(&BagScan::broken_chunks, here, why);
    walk(MemoryBytes(records_), 0, records_.size(), here, here);
  }

  /// Records [at, end) of a chunk.
  void walk(const ByteSource& bytes, std::uint64_t at, std::uint64_t end, std::uint64_t chunk,
            std::uint64_t here) {
    while (at < end) {
      const auto record = record_at(bytes, at);
      if (!record || record->content + record->size > end)
        return scan_.broken(&BagScan::broken_records, here, "a chunk whose records do not fill it");
      read_record(bytes, *record, chunk, here);
      at = record->content + record->size;
    }
  }

  /// A record that is no chunk. `here`: for messages.
  void read_record(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                   std::uint64_t here) {
    if (record.opcode == Opcode::message) return read_message(bytes, record, chunk, here);
    if (record.opcode != Opcode::schema && record.opcode != Opcode::channel) return;
    if (record.size > kMaxDescription)
      return scan_.broken(&BagScan::broken_records, here, "a description longer than 1 MiB");
    std::vector<std::uint8_t> content(static_cast<std::size_t>(record.size));
    if (!bytes.read(record.content, content))
      return scan_.broken(&BagScan::broken_records, here, "a description that cannot be read");
    LittleEndian in(content);
    const std::uint16_t id = in.u16();
    if (record.opcode == Opcode::schema) {
      std::string name = in.text();
      if (!in.ok() || name.size() > kMaxName)
        return scan_.broken(&BagScan::broken_records, here,
                            "a schema whose lengths contradict each other");
      types_.try_emplace(id, plain_type(name));
      return;
    }
    const std::uint16_t schema = in.u16();
    BagChannel channel{in.text(), "", to_encoding(in.text())};
    if (!in.ok() || channel.topic.size() > kMaxName)
      return scan_.broken(&BagScan::broken_records, here,
                          "a channel whose lengths contradict each other");
    if (const auto type = types_.find(schema); type != types_.end()) channel.type = type->second;
    channels_.try_emplace(id, std::move(channel));
  }

  void read_message(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                    std::uint64_t here) {
    std::array<std::uint8_t, kMessageHead> head{};
    if (record.size < kMessageHead || record.size > kMaxChunk || !bytes.read(record.content, head))
      return scan_.broken(&BagScan::broken_records, here,
                          "a message shorter than its head or longer than 64 MiB");
    LittleEndian in(head);
    const auto channel = channels_.find(in.u16());
    if (channel == channels_.end()) {
      ++scan_.orphans;
      return;
    }
    // The sequence number is skipped.
    (void)in.u32();
    const std::uint64_t log_time = in.u64();
    ++scan_.messages;
    each_({&channel->second,
           {chunk, record.content + kMessageHead,
            static_cast<std::uint32_t>(record.size - kMessageHead)},
           &bytes,
           static_cast<std::int64_t>(log_time)});
  }

  const ByteSource& file_;
  const BagVisitor& each_;
  BagScan scan_;
  // Unpacked records of the current chunk.
  std::vector<std::uint8_t> records_;
  // Types by schema.
  std::map<std::uint16_t, std::string> types_;
  std::map<std::uint16_t, BagChannel> channels_;
};

}  // namespace

std::optional<BagScan> scan_mcap(const ByteSource& file, const BagVisitor& each) {
  std::array<std::uint8_t, kMagic.size()> magic{};
  if (!file.read(0, magic) || magic != kMagic) return std::nullopt;
  return Scanner(file, each).scan();
}

bool unpack_mcap_chunk(const ByteSource& file, std::uint64_t offset,
                       std::vector<std::uint8_t>* records) {
  const auto record = record_at(file, offset);
  if (!record || record->opcode != Opcode::chunk) return false;
  const auto head = chunk_head(file, *record);
  return head && unpack(file, *head, records).empty();
}

}  // namespace vergence::app::detail
