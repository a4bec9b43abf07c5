#include <zlib.h>
#include <zstd.h>

#include "tests/support/bag_writer.hpp"

namespace vergence::test {
namespace {

std::string text(std::string_view s) { return number(s.size(), 4).append(s); }

std::string record_of(std::uint8_t opcode, std::string_view content) {
  return number(opcode, 1).append(number(content.size(), 8)).append(content);
}

std::string packed(const std::string& compression, const std::string& records) {
  if (compression == "zstd") {
    std::string out(ZSTD_compressBound(records.size()), '\0');
    out.resize(ZSTD_compress(out.data(), out.size(), records.data(), records.size(), 1));
    return out;
  }
  if (compression == "lz4") return lz4_frame(records);
  return records;
}

}  // namespace

McapWriter::McapWriter(std::string compression) : compression_(std::move(compression)) {
  file_.assign("\x89MCAP0\r\n", 8);
  record(1, text("ros2") + text("test"));
}

void McapWriter::channel(std::uint16_t id, std::string_view topic, std::string_view type) {
  std::string of_ros2(type);
  of_ros2.replace(of_ros2.find('/'), 1, "/msg/");
  chunk_ += record_of(3, number(id, 2) + text(of_ros2) + text("ros2msg") + text(""));
  chunk_ += record_of(4, number(id, 2) + number(id, 2) + text(topic) + text("cdr") + number(0, 4));
}

void McapWriter::message(std::uint16_t channel, std::int64_t log_time, std::string_view content) {
  const auto time = number(static_cast<std::uint64_t>(log_time), 8);
  chunk_ += record_of(5, (number(channel, 2) + number(0, 4) + time + time).append(content));
}

void McapWriter::close_chunk() {
  if (chunk_.empty()) return;
  const std::string body = packed(compression_, chunk_);
  const auto crc =
      ::crc32(0, reinterpret_cast<const Bytef*>(chunk_.data()), static_cast<uInt>(chunk_.size()));
  record(6, number(0, 8) + number(0, 8) + number(chunk_.size(), 8) + number(crc, 4) +
                text(compression_) + number(body.size(), 8) + body);
  chunk_.clear();
}

void McapWriter::record(std::uint8_t opcode, std::string_view content) {
  file_ += record_of(opcode, content);
}

void McapWriter::finish() {
  close_chunk();
  record(15, number(0, 4));
  record(2, std::string(20, 0));
  file_.append("\x89MCAP0\r\n", 8);
}

}  // namespace vergence::test
