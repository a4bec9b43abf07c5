#include "app/datasets/detail/bag_scan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "tests/support/temporary_folder.hpp"

namespace vergence::app::detail {
namespace {

std::size_t descriptors() {
  const std::filesystem::directory_iterator open("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(open), end(open)));
}

/// A drive that began a file a minute for a day.
TEST(FileBytes, readsMoreFilesThanOpenLimit) {
  constexpr std::size_t kFiles = 1440;
  const test::TemporaryFolder folder;
  std::vector<std::unique_ptr<FileBytes>> files;
  const std::size_t before = descriptors();
  for (std::size_t i = 0; i < kFiles; ++i) {
    const std::string name = std::to_string(i);
    folder.write(name, "file " + name);
    files.push_back(std::make_unique<FileBytes>(folder / name));
  }
  EXPECT_LE(descriptors(), before + 1) << "the one of this thread";
  std::atomic<int> wrong{0};
  const auto read_all = [&](std::size_t first) {
    for (std::size_t k = 0; k < kFiles; ++k) {
      const std::size_t i = (first + k * 7) % kFiles;
      const std::string wanted = std::to_string(i);
      std::vector<std::uint8_t> bytes(wanted.size());
      if (!files[i]->read(5, bytes) || !std::equal(wanted.begin(), wanted.end(), bytes.begin()))
        ++wrong;
    }
  };
  {
    std::vector<std::jthread> readers;
    for (std::size_t r = 0; r < 4; ++r) readers.emplace_back(read_all, r * 300);
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(descriptors(), before + 1);
}

}  // namespace
}  // namespace vergence::app::detail
