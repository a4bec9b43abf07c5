#include <algorithm>

#include "app/datasets/detail/record_scanner.hpp"
#include "app/datasets/detail/ros_reader.hpp"

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

/// Fields of a header that are used; missing ones are empty.
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

template <class T>
std::optional<T> number(std::string_view bytes) noexcept {
  if (bytes.size() != sizeof(T)) return std::nullopt;
  return RosReader({reinterpret_cast<const std::uint8_t*>(bytes.data()), sizeof(T)},
                   MessageEncoding::ros1)
      .get<T>();
}

void set_field(std::string_view name, std::string_view value, Header* header) {
  if (name == "op" && value.size() == 1) header->op = static_cast<std::uint8_t>(value[0]);
  if (name == "conn") header->connection = number<std::uint32_t>(value);
  if (name == "size") header->size = number<std::uint32_t>(value);
  if (name == "time")
    // The value holds seconds, then nanoseconds.
    if (const auto parts = number<std::uint64_t>(value))
      header->time = static_cast<std::int64_t>(*parts & 0xFFFFFFFFU) * 1'000'000'000 +
                     static_cast<std::int64_t>(*parts >> 32U);
  if (name == "index_pos") header->index = number<std::uint64_t>(value).value_or(0);
  if (value.size() > kMaxName) return;
  if (name == "compression") header->compression = value;
  if (name == "topic") header->topic = value;
  if (name == "type") header->type = value;
}

/// Parses fields `name=value`, each preceded by its length. Returns false if the lengths contradict
/// each other.
bool parse_fields(std::span<const std::uint8_t> bytes, Header* header) {
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  while (!rest.empty()) {
    const auto length = number<std::uint32_t>(rest.substr(0, kLength));
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
  std::uint64_t content = 0;
  // Size of the data in bytes.
  std::uint32_t size = 0;
};

std::uint32_t u32_at(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return RosReader(bytes.subspan(at), MessageEncoding::ros1).get<std::uint32_t>();
}

/// Returns the record at `offset`; empty if it is incomplete or invalid.
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
  record.content = offset + whole;
  if (record.size > bytes.size() - record.content) return std::nullopt;
  return record;
}

bool is(const Record& record, Opcode op) noexcept {
  return record.sound && record.header.op == static_cast<std::uint8_t>(op);
}

Chunk to_chunk(const Record& record) {
  const std::string& compression = record.header.compression;
  return {compression == "none" ? "" : compression, record.content, record.size,
          record.header.size.value_or(0)};
}

/// Scan of one file.
class RosbagScanner final : RecordScanner<Record> {
 public:
  RosbagScanner(const ByteSource& file, const BagVisitor& each)
      : RecordScanner(file, each, record_at) {}

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
      at = record->content + record->size;
      scan_.end = at;
    }
    scan_.finished = index != 0 && index <= at && at == file_.size();
    return std::move(scan_);
  }

 private:
  void read_chunk(const Record& record, std::uint64_t here) {
    // The recorder has not closed an empty chunk, whose records follow it.
    if (record.size == 0 && record.header.size.value_or(0) == 0) return;
    const Chunk chunk = to_chunk(record);
    if (!chunk.compression.empty() && !record.header.size)
      return scan_.skip(here, "a chunk without its size");
    RecordScanner::read_chunk(chunk, here);
  }

  void read_record(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                   std::uint64_t here) override {
    if (!record.sound) return scan_.skip(here, "a record whose header contradicts its length");
    if (is(record, Opcode::connection)) return read_connection(bytes, record, here);
    if (is(record, Opcode::message)) read_message(bytes, record, chunk, here);
  }

  void read_connection(const ByteSource& bytes, const Record& record, std::uint64_t here) {
    const auto data = description(bytes, record, here);
    Header about;
    if (!data) return;
    if (!parse_fields(*data, &about) || about.type.empty() || record.header.topic.empty() ||
        !record.header.connection)
      return scan_.skip(here, "a connection without a topic or a type");
    if (channels_.size() >= kMaxChannels) return scan_.skip(here, "one connection too many");
    channels_.try_emplace(
        *record.header.connection,
        BagChannel{record.header.topic, plain_type(about.type), MessageEncoding::ros1});
  }

  void read_message(const ByteSource& bytes, const Record& record, std::uint64_t chunk,
                    std::uint64_t here) {
    if (!record.header.connection || record.size > kMaxChunk)
      return scan_.skip(here, "a message without a connection or longer than 64 MiB");
    pass(*record.header.connection, bytes, {chunk, record.content, record.size},
         record.header.time);
  }
};

}  // namespace

std::optional<BagScan> scan_rosbag(const ByteSource& file, const BagVisitor& each) {
  std::array<std::uint8_t, kMagic.size()> magic{};
  if (!file.read(0, magic) || !std::equal(kMagic.begin(), kMagic.end(), magic.begin()))
    return std::nullopt;
  return RosbagScanner(file, each).scan();
}

bool unpack_rosbag_chunk(const ByteSource& file, std::uint64_t offset,
                         std::vector<std::uint8_t>* records) {
  const auto record = record_at(file, offset);
  return record && is(*record, Opcode::chunk) && record->header.size &&
         unpack(file, to_chunk(*record), records).empty();
}

}  // namespace vergence::app::detail
