#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace vergence::test {

/// Bytes in the order of XCDR1: values aligned to their size, counted from the first; either byte
/// order.
class CdrWriter {
 public:
  explicit CdrWriter(bool little = true) : little_(little) {}
  template <typename T>
  CdrWriter& put(T value) {
    bytes_.resize((bytes_.size() + sizeof(T) - 1) / sizeof(T) * sizeof(T));
    raw(&value, sizeof(T));
    return *this;
  }
  CdrWriter& text(std::string_view s) {
    put(static_cast<std::uint32_t>(s.size() + 1));
    bytes_.append(s).push_back('\0');
    return *this;
  }
  CdrWriter& blob(std::string_view s) {
    put(static_cast<std::uint32_t>(s.size()));
    bytes_.append(s);
    return *this;
  }
  /// std_msgs/msg/Header.
  CdrWriter& header(std::int64_t stamp_ns, std::string_view frame = "f") {
    put(static_cast<std::int32_t>(stamp_ns / 1'000'000'000))
        .put(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
    return text(frame);
  }
  [[nodiscard]] std::string bytes() const {
    return std::string{'\0', little_ ? '\1' : '\0', '\0', '\0'} + bytes_;
  }

 private:
  void raw(const void* value, std::size_t size) {
    const auto* b = static_cast<const char*>(value);
    for (std::size_t i = 0; i < size; ++i) bytes_.push_back(b[little_ ? i : size - 1 - i]);
  }
  bool little_;
  std::string bytes_;
};

/// An MCAP file in memory, as rosbag2 writes it but for index and summary.
class McapWriter {
 public:
  /// "", "lz4" or "zstd": what chunks are packed by.
  explicit McapWriter(std::string compression = "");
  /// Both into the open chunk.
  void channel(std::uint16_t id, std::string_view topic, std::string_view type);
  void message(std::uint16_t channel, std::int64_t log_time, std::string_view content);
  void close_chunk();
  /// Of any kind, outside chunks.
  void record(std::uint8_t opcode, std::string_view content);
  /// Closes the chunk, ends the data. Without it the file is an unfinished one.
  void finish();
  [[nodiscard]] const std::string& bytes() const { return file_; }

 private:
  std::string compression_, file_, chunk_;
};

}  // namespace vergence::test
