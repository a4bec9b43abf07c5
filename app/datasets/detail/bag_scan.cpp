#include "app/datasets/detail/bag_scan.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace vergence::app::detail {

std::string plain_type(std::string_view type) {
  constexpr std::string_view kOfRos2 = "/msg/";
  std::string plain(type);
  if (const std::size_t at = plain.find(kOfRos2); at != std::string::npos)
    plain.replace(at, kOfRos2.size(), "/");
  return plain;
}

std::vector<std::uint8_t> first_bytes(const BagMessage& message, std::size_t most) {
  std::vector<std::uint8_t> bytes(std::min<std::size_t>(most, message.place.size));
  if (!message.bytes->read(message.place.offset, bytes)) bytes.clear();
  return bytes;
}

void BagScan::skip(std::uint64_t offset, std::string_view why) {
  ++skipped;
  if (first_broken) return;
  first_broken = offset;
  why_broken = why;
}

void BagScan::remark(const std::string& name, std::vector<std::string>* remarks) const {
  if (!finished)
    remarks->push_back(fmt::format(
        "{} is incomplete: it is read up to offset {}, the end of its last complete record", name,
        end));
  if (first_broken)
    remarks->push_back(
        fmt::format("{}: {} chunks or records are skipped; the first at offset {} is {}", name,
                    skipped, *first_broken, why_broken));
  if (orphans > 0)
    remarks->push_back(
        fmt::format("{}: {} messages of unknown channels are skipped", name, orphans));
}

std::optional<BagScan> scan_bag(BagFormat format, const ByteSource& file, const BagVisitor& each) {
  if (format == BagFormat::sqlite) return scan_sqlite(file, each);
  return format == BagFormat::mcap ? scan_mcap(file, each) : scan_rosbag(file, each);
}

bool unpack_chunk(BagFormat format, const ByteSource& file, std::uint64_t offset,
                  std::vector<std::uint8_t>* records) {
  // SQLite bags have no chunks.
  if (format == BagFormat::sqlite) return false;
  return format == BagFormat::mcap ? unpack_mcap_chunk(file, offset, records)
                                   : unpack_rosbag_chunk(file, offset, records);
}

}  // namespace vergence::app::detail
