#include <bzlib.h>
#include <lz4frame.h>

#include <algorithm>

#include "tests/support/bag_writer.hpp"

namespace vergence::test {
namespace {

/// Bytes of the first record, padded.
constexpr std::size_t kBagHeader = 4096;

std::string fields_of(const RosbagWriter::Fields& fields) {
  std::string out;
  for (const auto& [name, value] : fields)
    out += number(name.size() + 1 + value.size(), 4).append(name).append("=").append(value);
  return out;
}

std::string record_of(const RosbagWriter::Fields& header, std::string_view data) {
  const std::string fields = fields_of(header);
  return (number(fields.size(), 4) + fields + number(data.size(), 4)).append(data);
}

std::string op(char code) { return {code}; }

std::string bag_header(std::uint64_t index, std::size_t connections, std::uint32_t chunks) {
  const RosbagWriter::Fields header{{"op", op(3)},
                                    {"index_pos", number(index, 8)},
                                    {"conn_count", number(connections, 4)},
                                    {"chunk_count", number(chunks, 4)}};
  return record_of(header, std::string(kBagHeader - 8 - fields_of(header).size(), ' '));
}

std::string time_of(std::int64_t ns) {
  return number(static_cast<std::uint64_t>(ns / 1'000'000'000), 4) +
         number(static_cast<std::uint64_t>(ns % 1'000'000'000), 4);
}

std::string packed(const std::string& compression, const std::string& records) {
  if (compression == "bz2") {
    auto size = static_cast<unsigned>(records.size() + records.size() / 100 + 600);
    std::string out(size, '\0');
    BZ2_bzBuffToBuffCompress(out.data(), &size, const_cast<char*>(records.data()),
                             static_cast<unsigned>(records.size()), 9, 0, 30);
    out.resize(size);
    return out;
  }
  if (compression == "lz4") return lz4_frame(records);
  return records;
}

constexpr const char* kMagic = "#ROSBAG V2.0\n";

}  // namespace

std::string number(std::uint64_t value, int size) {
  std::string out;
  for (int i = 0; i < size; ++i) out.push_back(static_cast<char>(value >> (8 * i) & 0xFFU));
  return out;
}

std::string lz4_frame(const std::string& records) {
  std::string out(LZ4F_compressFrameBound(records.size(), nullptr), '\0');
  out.resize(LZ4F_compressFrame(out.data(), out.size(), records.data(), records.size(), nullptr));
  return out;
}

RosbagWriter::RosbagWriter(std::string compression) : compression_(std::move(compression)) {
  file_ = kMagic + bag_header(0, 0, 0);
}

void RosbagWriter::channel(std::uint16_t id, std::string_view topic, std::string_view type) {
  const std::string name(topic);
  const std::string about = fields_of({{"topic", name},
                                       {"type", std::string(type)},
                                       {"md5sum", std::string(32, '0')},
                                       {"message_definition", ""}});
  const std::string whole =
      record_of({{"op", op(7)}, {"conn", number(id, 4)}, {"topic", name}}, about);
  chunk_ += whole;
  connections_[id] = whole;
}

void RosbagWriter::message(std::uint16_t channel, std::int64_t log_time, std::string_view content) {
  first_ = entries_.empty() ? log_time : std::min(first_, log_time);
  last_ = entries_.empty() ? log_time : std::max(last_, log_time);
  const std::string time = time_of(log_time);
  entries_[channel].push_back({time, chunk_.size()});
  chunk_ += record_of({{"op", op(2)}, {"conn", number(channel, 4)}, {"time", time}}, content);
}

void RosbagWriter::close_chunk() {
  if (chunk_.empty()) return;
  const std::size_t here = file_.size();
  record({{"op", op(5)}, {"compression", compression_}, {"size", number(chunk_.size(), 4)}},
         packed(compression_, chunk_));
  std::string counts;
  for (const auto& [channel, entries] : entries_) {
    std::string index;
    for (const Entry& entry : entries) index += entry.time + number(entry.offset, 4);
    record({{"op", op(4)},
            {"ver", number(1, 4)},
            {"conn", number(channel, 4)},
            {"count", number(entries.size(), 4)}},
           index);
    counts += number(channel, 4) + number(entries.size(), 4);
  }
  chunk_infos_ += record_of({{"op", op(6)},
                             {"ver", number(1, 4)},
                             {"chunk_pos", number(here, 8)},
                             {"start_time", time_of(first_)},
                             {"end_time", time_of(last_)},
                             {"count", number(entries_.size(), 4)}},
                            counts);
  ++chunks_;
  entries_.clear();
  chunk_.clear();
}

void RosbagWriter::record(const Fields& header, std::string_view data) {
  file_ += record_of(header, data);
}

void RosbagWriter::finish() {
  close_chunk();
  const std::size_t index = file_.size();
  for (const auto& [id, whole] : connections_) file_ += whole;
  file_ += chunk_infos_;
  const std::string head = kMagic + bag_header(index, connections_.size(), chunks_);
  file_.replace(0, head.size(), head);
}

std::unique_ptr<BagWriter> BagKind::writer() const {
  if (is_mcap()) return std::make_unique<McapWriter>(compression);
  return std::make_unique<RosbagWriter>(compression);
}

}  // namespace vergence::test
