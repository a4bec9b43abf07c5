// The bags of tests/support are read by the formats' own JavaScript packages. Without node, npm or
// the registry: skipped.
#include <gtest/gtest.h>

#include <cstdlib>

#include <fmt/format.h>

#include "tests/support/bag_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::test {
namespace {

TEST(BagPackages, readTheFilesOfTheTests) {
  const TemporaryFolder work;
  const std::string folder = work.path().string();
  const auto shell = [](const std::string& command) { return std::system(command.c_str()); };
  if (shell("node --version >/dev/null 2>&1") != 0 ||
      shell("cd '" + folder +
            "' && timeout 60 npm install --no-audit --no-fund --silent --no-save --prefix . "
            "@mcap/core@2.2.2 @foxglove/rosbag@0.4.1 >npm.log 2>&1") != 0)
    GTEST_SKIP() << "node, npm or its registry is not reached";
  for (const BagKind& kind : {BagKind{"rosbag", "none"}, BagKind{"mcap", ""}}) {
    const auto writer = kind.writer();
    writer->channel(1, "/left/image_raw", "sensor_msgs/Image");
    writer->channel(2, "/right/image_raw", "sensor_msgs/Image");
    std::string wanted;
    std::int64_t time = 1'700'000'000'000'000'000;
    for (const std::size_t size : {1U, 40U, 300U, 900U, 5U}) {
      const bool left = size % 2 == 0;
      std::string content, hex;
      for (std::size_t i = 0; i < size; ++i) {
        content.push_back(static_cast<char>(7 * i + size));
        hex += fmt::format("{:02x}", static_cast<unsigned char>(content.back()));
      }
      writer->message(left ? 1 : 2, time += 1'000'000, content);
      wanted += fmt::format("/{}/image_raw {}\n", left ? "left" : "right", hex);
      if (left) writer->close_chunk();
    }
    writer->finish();
    const auto file = work.write("b" + kind.ending(), writer->bytes());
    ASSERT_EQ(shell(fmt::format("NODE_PATH='{0}/node_modules' node "
                                "'" VERGENCE_SOURCE_DIR "/tests/system/bags/read_bags.cjs' '{1}' "
                                ">'{0}/out.txt' 2>'{0}/err.txt'",
                                folder, file.string())),
              0)
        << read_file(work / "err.txt");
    EXPECT_EQ(read_file(work / "out.txt"), wanted) << kind.container;
  }
}

}  // namespace
}  // namespace vergence::test
