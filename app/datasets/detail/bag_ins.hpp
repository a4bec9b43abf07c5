#pragma once
#include <filesystem>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/recorded_ins.hpp"

namespace vergence::app::detail {

/// The INS of a bag: NavSatFix with the orientation of Imu, as docs/datasets.md says.
/// Nothing and a remark: there is none, it has no attitude, or several topics could be it.
/// InputError  topics.ins or topics.imu is no topic of such messages.
[[nodiscard]] RecordedIns bag_ins(const std::filesystem::path& path, const BagIndex& bag,
                                  const BagTopics& topics);

}  // namespace vergence::app::detail
