#include <algorithm>

#include "app/datasets/detail/record_scanner.hpp"
#include "app/datasets/detail/ros_reader.hpp"

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

/// Numbers and texts of MCAP are written as those of ROS 1 messages: little endian, not aligned.
RosReader little_endian(std::span<const std::uint8_t> bytes) noexcept {
  return {bytes, MessageEncoding::ros1};
}

/// Returns the record at `offset`; empty if it is incomplete.
std::optional<Record> record_at(const ByteSource& bytes, std::uint64_t offset) noexcept {
  std::array<std::uint8_t, kRecordHead> head{};
  if (!bytes.read(offset, head) || head[0] == 0) return std::nullopt;
  Record record{static_cast<Opcode>(head[0]), offset + kRecordHead,
                little_endian(std::span(head).subspan(1)).get<std::uint64_t>()};
  if (record.size > bytes.size() - record.content) return std::nullopt;
  return record;
}

std::optional<Chunk> find_chunk(const ByteSource& file, const Record& record) {
  std::array<std::uint8_t, kChunkHead + kMaxCompression + 8> bytes{};
  const auto there = std::span(bytes).first(
      static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), record.size)));
  if (!file.read(record.content, there) || there.size() < kChunkHead) return std::nullopt;
  RosReader in = little_endian(there.subspan(16));
  Chunk chunk;
  chunk.unpacked = in.get<std::uint64_t>();
  chunk.crc = in.get<std::uint32_t>();
  chunk.compression = in.text();
  chunk.size = in.get<std::uint64_t>();
  chunk.offset = record.content + kChunkHead + chunk.compression.size() + 8;
  if (!in.ok() || chunk.size > record.content + record.size - chunk.offset) return std::nullopt;
  return chunk;
}

/// Scan of one file.
class McapScanner final : RecordScanner<Record> {
 public:
  McapScanner(const ByteSource& file, const BagVisitor& each)
      : RecordScanner(file, each, record_at) {}

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
    if (const auto chunk = find_chunk(file_, record))
      return RecordScanner::read_chunk(*chunk, here);
    scan_.skip(here, "a chunk whose head contradicts its length");
  }

  void read_record(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                   std::uint64_t here) override {
    if (record.opcode == Opcode::message) return read_message(bytes, record, chunk, here);
    if (record.opcode != Opcode::schema && record.opcode != Opcode::channel) return;
    const auto content = description(bytes, record, here);
    if (!content) return;
    RosReader in = little_endian(*content);
    const std::uint16_t id = in.get<std::uint16_t>();
    if (record.opcode == Opcode::schema) {
      std::string name = in.text();
      if (!in.ok() || name.size() > kMaxName)
        return scan_.skip(here, "a schema whose lengths contradict each other");
      types_.try_emplace(id, plain_type(name));
      return;
    }
    const std::uint16_t schema = in.get<std::uint16_t>();
    BagChannel channel;
    channel.topic = in.text();
    const std::string encoding = in.text();
    if (encoding == "cdr") channel.encoding = MessageEncoding::cdr;
    if (encoding == "ros1") channel.encoding = MessageEncoding::ros1;
    if (!in.ok() || channel.topic.size() > kMaxName)
      return scan_.skip(here, "a channel whose lengths contradict each other");
    if (const auto type = types_.find(schema); type != types_.end()) channel.type = type->second;
    channels_.try_emplace(id, std::move(channel));
  }

  void read_message(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                    std::uint64_t here) {
    std::array<std::uint8_t, kMessageHead> head{};
    if (record.size < kMessageHead || record.size > kMaxChunk || !bytes.read(record.content, head))
      return scan_.skip(here, "a message shorter than its head or longer than 64 MiB");
    RosReader in = little_endian(head);
    const auto channel = in.get<std::uint16_t>();
    // The sequence number is skipped.
    (void)in.get<std::uint32_t>();
    const auto log_time = static_cast<std::int64_t>(in.get<std::uint64_t>());
    pass(channel, bytes,
         {chunk, record.content + kMessageHead,
          static_cast<std::uint32_t>(record.size - kMessageHead)},
         log_time);
  }

  // Types by schema.
  std::map<std::uint16_t, std::string> types_;
};

}  // namespace

std::optional<BagScan> scan_mcap(const ByteSource& file, const BagVisitor& each) {
  std::array<std::uint8_t, kMagic.size()> magic{};
  if (!file.read(0, magic) || magic != kMagic) return std::nullopt;
  return McapScanner(file, each).scan();
}

bool unpack_mcap_chunk(const ByteSource& file, std::uint64_t offset,
                       std::vector<std::uint8_t>* records) {
  const auto record = record_at(file, offset);
  if (!record || record->opcode != Opcode::chunk) return false;
  const auto chunk = find_chunk(file, *record);
  return chunk && unpack(file, *chunk, records).empty();
}

}  // namespace vergence::app::detail
