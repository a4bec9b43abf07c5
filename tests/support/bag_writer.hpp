#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace vergence::test {

/// Serialisation of messages: CDR in either byte order, or as ROS 1 does it.
enum class Wire : std::uint8_t { cdr, cdr_big, ros1 };

/// The bytes of a ROS message. CDR: values aligned to their size, behind four bytes that say the
/// byte order.
class RosWriter {
 public:
  explicit RosWriter(Wire wire = Wire::cdr) : wire_(wire) {}
  template <typename T>
  RosWriter& put(T value) {
    if (wire_ != Wire::ros1) bytes_.resize((bytes_.size() + sizeof(T) - 1) / sizeof(T) * sizeof(T));
    raw(&value, sizeof(T));
    return *this;
  }
  template <typename T>
  RosWriter& put_all(const std::vector<T>& values) {
    for (const T value : values) put(value);
    return *this;
  }
  RosWriter& text(std::string_view s) {
    put(static_cast<std::uint32_t>(s.size() + (wire_ == Wire::ros1 ? 0 : 1)));
    bytes_.append(s);
    if (wire_ != Wire::ros1) bytes_.push_back('\0');
    return *this;
  }
  RosWriter& blob(std::string_view s) {
    put(static_cast<std::uint32_t>(s.size()));
    bytes_.append(s);
    return *this;
  }
  /// std_msgs/Header.
  RosWriter& header(std::int64_t stamp_ns, std::string_view frame = "f") {
    // The publisher's count.
    if (wire_ == Wire::ros1) put(std::uint32_t{7});
    put(static_cast<std::int32_t>(stamp_ns / 1'000'000'000))
        .put(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
    return text(frame);
  }
  [[nodiscard]] std::string bytes() const {
    if (wire_ == Wire::ros1) return bytes_;
    return std::string{'\0', wire_ == Wire::cdr ? '\1' : '\0', '\0', '\0'} + bytes_;
  }

 private:
  void raw(const void* value, std::size_t size) {
    const auto* b = static_cast<const char*>(value);
    for (std::size_t i = 0; i < size; ++i)
      bytes_.push_back(b[wire_ == Wire::cdr_big ? size - 1 - i : i]);
  }
  Wire wire_;
  std::string bytes_;
};

/// A number of `size` bytes, little endian.
[[nodiscard]] std::string number(std::uint64_t value, int size);
/// Records packed as one frame of LZ4.
[[nodiscard]] std::string lz4_frame(const std::string& records);

/// A recording in memory.
class BagWriter {
 public:
  virtual ~BagWriter() = default;
  /// Both into the open chunk. `type`: as ROS 1 writes it.
  virtual void channel(std::uint16_t id, std::string_view topic, std::string_view type) = 0;
  virtual void message(std::uint16_t channel, std::int64_t log_time, std::string_view content) = 0;
  virtual void close_chunk() = 0;
  /// Closes the chunk, ends the data. Without it the file is an unfinished one.
  virtual void finish() = 0;
  [[nodiscard]] const std::string& bytes() const { return file_; }

 protected:
  std::string file_, chunk_;
};

/// As rosbag2 writes it but for index and summary.
class McapWriter final : public BagWriter {
 public:
  /// "", "lz4" or "zstd": what chunks are packed by.
  explicit McapWriter(std::string compression = "");
  void channel(std::uint16_t id, std::string_view topic, std::string_view type) override;
  void message(std::uint16_t channel, std::int64_t log_time, std::string_view content) override;
  void close_chunk() override;
  /// Writes a record of any kind outside chunks.
  void record(std::uint8_t opcode, std::string_view content);
  void finish() override;

 private:
  std::string compression_;
};

/// A ROS 1 bag of version 2.0 with its index, as `rosbag record` writes it.
class RosbagWriter final : public BagWriter {
 public:
  /// "none", "lz4" or "bz2": what chunks are packed by.
  explicit RosbagWriter(std::string compression = "none");
  void channel(std::uint16_t id, std::string_view topic, std::string_view type) override;
  void message(std::uint16_t channel, std::int64_t log_time, std::string_view content) override;
  void close_chunk() override;
  void finish() override;

  using Fields = std::vector<std::pair<std::string, std::string>>;
  /// Writes a record of any kind outside chunks.
  void record(const Fields& header, std::string_view data);

 private:
  struct Entry {
    /// 8 bytes.
    std::string time;
    /// In the chunk.
    std::size_t offset = 0;
  };
  std::string compression_;
  /// Records of the connections.
  std::map<std::uint16_t, std::string> connections_;
  /// Entries of the open chunk.
  std::map<std::uint16_t, std::vector<Entry>> entries_;
  /// Log times of the open chunk, ns.
  std::int64_t first_ = 0, last_ = 0;
  std::string chunk_infos_;
  std::uint32_t chunks_ = 0;
};

/// A kind of recording: the container, what its chunks are packed by, how its messages are
/// serialised.
struct BagKind {
  /// "mcap" or "rosbag": the words of --format.
  const char* container;
  const char* compression;

  [[nodiscard]] bool is_mcap() const { return std::string_view(container) == "mcap"; }
  [[nodiscard]] Wire wire() const { return is_mcap() ? Wire::cdr : Wire::ros1; }
  /// Returns the format by a file's name.
  [[nodiscard]] std::string ending() const { return is_mcap() ? ".mcap" : ".bag"; }
  [[nodiscard]] std::unique_ptr<BagWriter> writer() const;
};

}  // namespace vergence::test
