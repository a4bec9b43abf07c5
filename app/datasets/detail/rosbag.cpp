#include "app/datasets/detail/bag_scan.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "app/datasets/detail/little_endian.hpp"

namespace vergence::app::detail {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
// Size of a length field in bytes.
constexpr std::uint64_t kLength = 4;
// In bytes. A message's header with both lengths has 46.
constexpr std::uint64_t kUsualHead = 128;
// Maximum size of a record's header, in bytes.
constexpr std::uint64_t kMaxHeader = 4096;

enum class Opcode : std::uint8_t { message = 2, bag_header = 3, chunk = 5, connection = 7 };

/// The fields of a header that are read; what is not there is empty.
struct Header {
  std::optional<std::uint8_t> op{};
  std::optional<std::uint32_t> connection{};
  // Unpacked size of a chunk.
  std::optional<std::uint32_t> size{};
  // Offset of the index; 0 if there is none.
  std::uint64_t index = 0;
  // Recording time of a message in ns.
  std::int64_t time = 0;
  std::string compression{}, topic{}, type{};
};

std::optional<std::uint64_t> number(std::string_view bytes, std::size_t size) noexcept {
  if (bytes.size() != size) return std::nullopt;
  return LittleEndian({reinterpret_cast<const std::uint8_t*>(bytes.data()), size}).number(size);
}

void set_field(std::string_view name, std::string_view value, Header* header) {
  const auto narrow = [](std::optional<std::uint64_t> n) {
    return n ? std::optional(static_cast<std::uint32_t>(*n)) : std::nullopt;
  };
  if (name == "op" && value.size() == 1) header->op = static_cast<std::uint8_t>(value[0]);
  if (name == "conn") header->connection = narrow(number(value, 4));
  if (name == "size") header->size = narrow(number(value, 4));
  if (name == "time")
    // The value holds seconds, then nanoseconds.
    if (const auto parts = number(value, 8))
      header->time = static_cast<std::int64_t>(*parts & 0xFFFFFFFFU) * 1'000'000'000 +
                     static_cast<std::int64_t>(*parts >> 32U);
  if (name == "index_pos") header->index = number(value, 8).value_or(0);
  if (value.size() > kMaxName) return;
  if (name == "compression") header->compression = value;
  if (name == "topic") header->topic = value;
  if (name == "type") header->type = value;
}

/// Fields `name=value` with a length before each. False: the lengths contradict each other.
bool parse_fields(std::span<const std::uint8_t> bytes, Header* header) {
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  while (!rest.empty()) {
    const auto length = number(rest.substr(0, kLength), kLength);
    if (!length || *length > rest.size() - kLength) return false;
    const std::string_view field = rest.substr(kLength, static_cast<std::size_t>(*length));
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) return false;
    set_field(field.substr(0, equals), field.substr(equals + 1), header);
    rest.remove_prefix(kLength + field.size());
  }
  return true;
}

struct Record {
  Header header{};
  // True if the header is valid.
  bool sound = false;
  // Offset of the data.
  std::uint64_t data = 0;
  // Size of the data in bytes.
  std::uint32_t size = 0;
};

std::uint32_t u32_at(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return LittleEndian(bytes.subspan(at)).u32();
}

/// The record at `offset`; nothing: it is not all there, or no record begins like this.
std::optional<Record> record_at(const ByteSource& bytes, std::uint64_t offset) {
  if (offset > bytes.size()) return std::nullopt;
  const std::uint64_t rest = bytes.size() - offset;
  std::array<std::uint8_t, kUsualHead> usual{};
  const auto head =
      std::span(usual).first(static_cast<std::size_t>(std::min<std::uint64_t>(usual.size(), rest)));
  if (head.size() < 2 * kLength || !bytes.read(offset, head)) return std::nullopt;
  const std::uint64_t length = u32_at(head, 0);
  if (length > kMaxHeader || length + 2 * kLength > rest) return std::nullopt;
  const auto whole = static_cast<std::size_t>(length + 2 * kLength);
  std::vector<std::uint8_t> longer;
  std::span<const std::uint8_t> there = head;
  if (whole > head.size()) {
    longer.resize(whole);
    if (!bytes.read(offset, longer)) return std::nullopt;
    there = longer;
  }
  Record record;
  record.sound =
      parse_fields(there.subspan(kLength, static_cast<std::size_t>(length)), &record.header) &&
      record.header.op;
  record.size = u32_at(there, static_cast<std::size_t>(whole - kLength));
  record.data = offset + whole;
  if (record.size > bytes.size() - record.data) return std::nullopt;
  return record;
}

bool is(const Record& record, Opcode op) noexcept {
  return record.sound && record.header.op == static_cast<std::uint8_t>(op);
}

/// Why a chunk cannot be unpacked; empty: it is in *records.
std::string unpack(const ByteSource& file, const Record& chunk,
                   std::vector<std::uint8_t>* records) {
  const std::string& compression = chunk.header.compression;
  if (!chunk.header.size) return "a chunk that does not say its size";
  if (chunk.size > kMaxChunk || *chunk.header.size > kMaxChunk)
    return "a chunk larger than 64 MiB; write the bag with smaller chunks";
  if (compression != "bz2" && compression != "lz4")
    return "a chunk of the compression \"" + compression.substr(0, 60) +
           "\"; bz2, lz4 and none can be read";
  std::vector<std::uint8_t> packed(chunk.size);
  if (!file.read(chunk.data, packed)) return "a chunk that cannot be read";
  records->resize(*chunk.header.size);
  if (!decompress(compression, packed, *records))
    return "a chunk whose " + compression + " data do not unpack";
  return "";
}

/// One scan of one file.
class Scanner {
 public:
  Scanner(const ByteSource& file, const BagVisitor& each) : file_(file), each_(each) {}

  BagScan scan() {
    std::uint64_t at = kMagic.size();
    scan_.end = at;
    std::uint64_t index = 0;
    while (const auto record = record_at(file_, at)) {
      if (is(*record, Opcode::bag_header)) index = record->header.index;
      if (is(*record, Opcode::chunk))
        read_chunk(*record, at);
      else
        read_record(file_, *record, BagPlace::kNoChunk, at);
      at = record->data + record->size;
      scan_.end = at;
    }
    scan_.finished = index != 0 && index <= at && at == file_.size();
    return std::move(scan_);
  }

 private:
  void read_chunk(const Record& chunk, std::uint64_t here) {
    // The recorder never closed this chunk.
    if (chunk.size == 0 && chunk.header.size.value_or(0) == 0) return;
    if (chunk.header.compression == "none" || chunk.header.compression.empty())
      return walk(file_, chunk.data, chunk.data + chunk.size, BagPlace::kNoChunk, here);
    if (const std::string why = unpack(file_, chunk, &records_); !why.empty())
      return scan_.broken(&BagScan::broken_chunks, here, why);
    walk(MemoryBytes(records_), 0, records_.size(), here, here);
  }

  /// Records [at, end) of a chunk.
  void walk(const ByteSource& bytes, std::uint64_t at, std::uint64_t end, std::uint64_t chunk,
            std::uint64_t here) {
    while (at < end) {
      const auto record = record_at(bytes, at);
      if (!record || record->data + record->size > end)
        return scan_.broken(&BagScan::broken_records, here, "a chunk whose records do not fill it");
      read_record(bytes, *record, chunk, here);
      at = record->data + record->size;
    }
  }

  /// A record that is no chunk. `here`: for messages.
  void read_record(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                   std::uint64_t here) {
    if (!record.sound)
      return scan_.broken(&BagScan::broken_records, here,
                          "a record whose header contradicts its length");
    if (is(record, Opcode::connection)) return read_connection(bytes, record, here);
    if (is(record, Opcode::message)) read_message(bytes, record, chunk, here);
  }

  void read_connection(const ByteSource& bytes, const Record& record, std::uint64_t here) {
    if (record.size > kMaxDescription)
      return scan_.broken(&BagScan::broken_records, here, "a description longer than 1 MiB");
    std::vector<std::uint8_t> data(record.size);
    Header about;
    if (!bytes.read(record.data, data) || !parse_fields(data, &about) || about.type.empty() ||
        record.header.topic.empty() || !record.header.connection)
      return scan_.broken(&BagScan::broken_records, here, "a connection without a topic or a type");
    if (channels_.size() >= kMaxChannels)
      return scan_.broken(&BagScan::broken_records, here, "one connection too many");
    channels_.try_emplace(
        *record.header.connection,
        BagChannel{record.header.topic, plain_type(about.type), MessageEncoding::ros1});
  }

  void read_message(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                    std::uint64_t here) {
    if (!record.header.connection || record.size > kMaxChunk)
      return scan_.broken(&BagScan::broken_records, here,
                          "a message without a connection or longer than 64 MiB");
    const auto channel = channels_.find(*record.header.connection);
    if (channel == channels_.end()) {
      ++scan_.orphans;
      return;
    }
    ++scan_.messages;
    each_({&channel->second, {chunk, record.data, record.size}, &bytes, record.header.time});
  }

  const ByteSource& file_;
  const BagVisitor& each_;
  BagScan scan_;
  // Unpacked records of the current chunk.
  std::vector<std::uint8_t> records_;
  std::map<std::uint32_t, BagChannel> channels_;
};

}  // namespace

std::optional<BagScan> scan_rosbag(const ByteSource& file, const BagVisitor& each) {
  std::array<std::uint8_t, kMagic.size()> magic{};
  if (!file.read(0, magic) || !std::equal(kMagic.begin(), kMagic.end(), magic.begin()))
    return std::nullopt;
  return Scanner(file, each).scan();
}

bool unpack_rosbag_chunk(const ByteSource& file, std::uint64_t offset,
                         std::vector<std::uint8_t>* records) {
  const auto record = record_at(file, offset);
  return record && is(*record, Opcode::chunk) && unpack(file, *record, records).empty();
}

}  // namespace vergence::app::detail
