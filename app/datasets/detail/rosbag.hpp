#pragma once
#include "app/datasets/detail/bag_scan.hpp"

/// Messages out of ROS 1 bags (wiki.ros.org/Bags/Format/2.0), front to back; index records and the
/// places that they name are passed over.
namespace vergence::app::detail {

/// As scan_bag(). A chunk that its recorder never closed says that it is empty, and its records
/// follow: those of one without compression are read like others of the file.
[[nodiscard]] std::optional<BagScan> scan_rosbag(const ByteSource& file, const BagVisitor& each);

/// As unpack_chunk().
[[nodiscard]] bool unpack_rosbag_chunk(const ByteSource& file, std::uint64_t offset,
                                       std::vector<std::uint8_t>* records);

}  // namespace vergence::app::detail
