// Bags against the formats' own JavaScript packages: their writer's file is read here, the files of
// tests/support are read there. Without node, npm or the registry: skipped.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "app/datasets/detail/bag_scan.hpp"
#include "tests/support/bag_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPackages = "@mcap/core@2.2.2 @foxglove/rosbag@0.4.1";

std::string read(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

class BagPackages : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    packages_ = new TemporaryFolder;
    const std::string command = "cd '" + packages_->path().string() +
                                "' && timeout 60 npm install --no-audit --no-fund --silent "
                                "--no-save --prefix . " +
                                kPackages + " >npm.log 2>&1";
    installed_ =
        std::system("node --version >/dev/null 2>&1") == 0 && std::system(command.c_str()) == 0;
  }
  static void TearDownTestSuite() { delete packages_; }
  void SetUp() override {
    if (!installed_) GTEST_SKIP() << "node, npm or its registry is not reached";
  }

  /// Output of one of the scripts beside this file.
  [[nodiscard]] std::string node(const std::string& script, const std::string& arguments) const {
    const fs::path out = work_ / "out.txt";
    const std::string command = "NODE_PATH='" + (packages_->path() / "node_modules").string() +
                                "' node '" VERGENCE_SOURCE_DIR "/tests/system/bags/" + script +
                                "' " + arguments + " >'" + out.string() + "' 2>'" +
                                (work_ / "err.txt").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << read(work_ / "err.txt");
    return read(out);
  }

  TemporaryFolder work_;
  static TemporaryFolder* packages_;
  static bool installed_;
};

TemporaryFolder* BagPackages::packages_ = nullptr;
bool BagPackages::installed_ = false;

/// Messages of several sizes, with all bytes.
std::vector<std::string> contents() {
  std::vector<std::string> list;
  for (const std::size_t size : {1U, 40U, 300U, 900U, 5U}) {
    std::string content(size, '\0');
    for (std::size_t i = 0; i < size; ++i) content[i] = static_cast<char>(7 * i + size);
    list.push_back(content);
  }
  return list;
}

std::string hex(const std::string& bytes) {
  std::string out;
  for (const char c : bytes)
    for (const unsigned shift : {4U, 0U})
      out += "0123456789abcdef"[static_cast<unsigned char>(c) >> shift & 0xFU];
  return out;
}

TEST_F(BagPackages, FileOfTheMcapPackageIsReadHere) {
  const fs::path bag = work_ / "a.mcap";
  std::string arguments = "'" + bag.string() + "'";
  for (const std::string& content : contents())
    arguments += " '" + work_.write("c" + std::to_string(content.size()), content).string() + "'";
  (void)node("write_mcap.cjs", arguments);
  using namespace app::detail;
  const FileBytes file(bag);
  std::vector<std::string> found;
  const auto scan = scan_bag(BagFormat::mcap, file, [&](const BagMessage& m) {
    EXPECT_EQ(m.channel->topic, "/left/image_raw");
    EXPECT_EQ(m.channel->type, "sensor_msgs/Image");
    std::string content(m.place.size, '\0');
    EXPECT_TRUE(m.bytes->read(m.place.offset,
                              {reinterpret_cast<std::uint8_t*>(content.data()), content.size()}));
    found.push_back(content);
  });
  ASSERT_TRUE(scan);
  EXPECT_TRUE(scan->finished);
  EXPECT_FALSE(scan->first_broken) << scan->why_broken;
  EXPECT_EQ(found, contents());
}

TEST_F(BagPackages, FilesOfTheTestsAreReadThere) {
  for (const BagKind& kind : {BagKind{"rosbag", "none"}, BagKind{"mcap", ""}}) {
    const auto writer = kind.writer();
    writer->channel(1, "/left/image_raw", "sensor_msgs/Image");
    writer->channel(2, "/right/image_raw", "sensor_msgs/Image");
    std::string wanted;
    std::int64_t time = 1'700'000'000'000'000'000;
    for (const std::string& content : contents()) {
      const bool left = content.size() % 2 == 0;
      writer->message(left ? 1 : 2, time += 1'000'000, content);
      wanted += std::string(left ? "/left" : "/right") + "/image_raw " + hex(content) + "\n";
      if (left) writer->close_chunk();
    }
    writer->finish();
    const fs::path file = work_.write("b" + kind.ending(), writer->bytes());
    EXPECT_EQ(node("read_bags.cjs", "'" + file.string() + "'"), wanted) << kind.container;
  }
}

}  // namespace
}  // namespace vergence::test
