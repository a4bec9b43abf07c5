#pragma once
#include "app/datasets/detail/bag_scan.hpp"

/// Messages out of MCAP files (mcap.dev, specification version 0), front to back; neither index nor
/// summary is believed or needed.
namespace vergence::app::detail {

/// As scan_bag(): chunks without compression are read 9 bytes a record and 22 a message. Their
/// check sums are not looked at.
[[nodiscard]] std::optional<BagScan> scan_mcap(const ByteSource& file, const BagVisitor& each);

/// As unpack_chunk().
[[nodiscard]] bool unpack_mcap_chunk(const ByteSource& file, std::uint64_t offset,
                                     std::vector<std::uint8_t>* records);

}  // namespace vergence::app::detail
