#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/datasets/detail/formats.hpp"

namespace vergence::test {

/// The drive of a bag of one file that is not on a disk; `bytes` outlive it. `given`: without a
/// calibration.
[[nodiscard]] inline app::StereoSequence bag_in_memory(bool mcap, std::span<const char> bytes,
                                                       bool given = true,
                                                       const app::BagTopics& topics = {}) {
  using namespace app::detail;
  const BagFormat format = mcap ? BagFormat::mcap : BagFormat::rosbag;
  const std::string name = mcap ? "a.mcap" : "a.bag";
  std::vector<BagFile> files;
  files.push_back({name, std::make_unique<MemoryBytes>(std::span(
                             reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()))});
  return sequence_of(name, index_bag(format, name, std::move(files)), given, topics);
}

}  // namespace vergence::test
