#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "app/datasets/detail/formats.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::test {

/// The drive of a bag of one file that is not on a disk, except for SQLite's; `bytes` outlive it.
/// `given`: without a calibration.
[[nodiscard]] inline app::StereoSequence bag_in_memory(app::detail::BagFormat format,
                                                       std::span<const char> bytes,
                                                       bool given = true,
                                                       const app::BagTopics& topics = {}) {
  using namespace app::detail;
  const std::string name = "a.bag";
  const std::span view(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  std::vector<BagFile> files;
  if (format == BagFormat::sqlite) {
    const TemporaryFolder folder;
    folder.write(name, {bytes.data(), bytes.size()});
    files.push_back({name, open_sqlite_bag(folder / name)});
  } else {
    files.push_back({name, std::make_unique<MemoryBytes>(view)});
  }
  return make_sequence(name, index_bag(format, name, std::move(files)), given, topics);
}

/// Finishes the bag as `mcap` or else as rosbag.
[[nodiscard]] inline app::StereoSequence bag_in_memory(bool mcap, std::span<const char> bytes,
                                                       bool given = true,
                                                       const app::BagTopics& topics = {}) {
  using app::detail::BagFormat;
  return bag_in_memory(mcap ? BagFormat::mcap : BagFormat::rosbag, bytes, given, topics);
}

}  // namespace vergence::test
