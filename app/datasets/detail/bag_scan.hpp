#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/datasets/detail/byte_source.hpp"

/// Messages out of recordings of ROS, whatever container they are in: front to back, indexes and
/// summaries are neither believed nor needed.
namespace vergence::app::detail {

inline constexpr std::uint64_t kMaxChunk =
    std::uint64_t{64}
    << 20U;  // bytes, packed or unpacked: rosbag and rosbag2 write less than 1 MiB
inline constexpr std::uint64_t kMaxDescription =
    std::uint64_t{1} << 20;                         // bytes of a record that describes a channel
inline constexpr std::size_t kMaxName = 1024;       // bytes of a topic's or a type's name
inline constexpr std::size_t kMaxChannels = 65536;  // of a file

enum class BagFormat : std::uint8_t { mcap, rosbag, sqlite };

/// Serialisation of a channel's messages: by CDR (ROS 2), as ROS 1 does it, or in a way that
/// is not read.
enum class MessageEncoding : std::uint8_t { cdr, ros1, other };

struct BagChannel {
  std::string topic;
  std::string type;  // as ROS 1 writes it: sensor_msgs/Image
  MessageEncoding encoding = MessageEncoding::other;
};

/// The type's name as ROS 1 writes it: without the /msg/ of ROS 2.
[[nodiscard]] std::string plain_type(std::string_view type);

/// Where a message's content is.
struct BagPlace {
  static constexpr std::uint64_t kNoChunk = 0;
  std::uint64_t chunk = kNoChunk;  // offset of a packed chunk's record in the file; kNoChunk:
                                   // `offset` counts from the file's start
  std::uint64_t offset = 0;        // of the message's content, in the unpacked records of the chunk
  std::uint32_t size = 0;          // bytes of the content
};

struct BagMessage {
  const BagChannel* channel = nullptr;  // until the scan ends
  BagPlace place{};
  const ByteSource* bytes = nullptr;  // where place.offset counts; during the call
  std::int64_t log_time = 0;          // ns, when it was recorded
};

/// The first `most` bytes of a message's content, or all; empty: they cannot be read.
[[nodiscard]] std::vector<std::uint8_t> first_bytes(const BagMessage& message, std::size_t most);

using BagVisitor = std::function<void(const BagMessage&)>;

/// Result of a scan.
struct BagScan {
  std::uint64_t messages = 0;
  std::uint64_t orphans = 0;  // messages of no channel that was described before them
  std::uint64_t broken_chunks =
      0;  // do not unpack, fail their check sum, or are larger than kMaxChunk: skipped
  std::uint64_t broken_records =
      0;  // descriptions that contradict themselves, messages shorter than their head: skipped
  std::optional<std::uint64_t> first_broken{};  // offset in the file of the first of these
  std::string why_broken{};                     // and what is wrong with it: a phrase
  bool finished = false;                        // its writer closed it
  std::uint64_t end = 0;                        // offset behind the last whole record

  /// One more of `counter`, which is broken_chunks or broken_records.
  void broken(std::uint64_t BagScan::*counter, std::uint64_t offset, std::string_view why);
  /// Says what is missing of the file of this name.
  void remark(const std::string& name, std::vector<std::string>* remarks) const;
};

/// Hands every message to `each`, in the file's order (of sqlite in that of log times); content
/// that is not all there is not handed over. Chunks without compression are read where they lie,
/// the heads of messages only, whatever their length. Nothing: the file does not begin as the
/// format does. Precondition: of sqlite a SqliteBag. Memory  Two times kMaxChunk, and
/// kMaxChannels names, at most.
[[nodiscard]] std::optional<BagScan> scan_bag(BagFormat format, const ByteSource& file,
                                              const BagVisitor& each);

/// Unpacks the chunk at `offset` of the file into *records. False: it is not as the scan found it;
/// *records undefined.
[[nodiscard]] bool unpack_chunk(BagFormat format, const ByteSource& file, std::uint64_t offset,
                                std::vector<std::uint8_t>* records);

// The containers' parts of scan_bag() and unpack_chunk().
//
// MCAP (mcap.dev, specification version 0) front to back; neither index nor summary is believed or
// needed. Chunks without compression are read 9 bytes a record and 22 a message; their check sums
// are not looked at.
[[nodiscard]] std::optional<BagScan> scan_mcap(const ByteSource& file, const BagVisitor& each);
[[nodiscard]] bool unpack_mcap_chunk(const ByteSource& file, std::uint64_t offset,
                                     std::vector<std::uint8_t>* records);

// ROS 1 bags (wiki.ros.org/Bags/Format/2.0) front to back; index records and the places that they
// name are passed over. A chunk that its recorder never closed says that it is empty, and its
// records follow: those of one without compression are read like others of the file.
[[nodiscard]] std::optional<BagScan> scan_rosbag(const ByteSource& file, const BagVisitor& each);
[[nodiscard]] bool unpack_rosbag_chunk(const ByteSource& file, std::uint64_t offset,
                                       std::vector<std::uint8_t>* records);

/// The frame or frames of `packed` as `name` says ("zstd", "lz4", "bz2"), exactly `records.size()`
/// bytes. False: they are not.
[[nodiscard]] bool decompress(std::string_view name, std::span<const std::uint8_t> packed,
                              std::span<std::uint8_t> records) noexcept;

}  // namespace vergence::app::detail
