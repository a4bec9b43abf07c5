#pragma once
#include <filesystem>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/recorded_ins.hpp"

namespace vergence::app::detail {

/// INS of a bag: NavSatFix with the orientation of Imu (docs/datasets.md). Empty with a remark if
/// there is none, it has no attitude, or several topics match. Throws InputError if topics.ins or
/// topics.imu has other messages.
[[nodiscard]] RecordedIns bag_ins(const std::filesystem::path& path, const BagIndex& bag,
                                  const BagTopics& topics);

}  // namespace vergence::app::detail
