#include "app/datasets/detail/mcap.hpp"

#include <gtest/gtest.h>

#include "app/runtime/errors.hpp"
#include "tests/support/mcap_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app::detail {
namespace {

using test::McapWriter;
using test::TemporaryFolder;

/// Two chunks of two messages each.
std::string small_file(const std::string& compression) {
  McapWriter writer(compression);
  writer.channel(1, "/left/image_raw", "sensor_msgs/msg/Image");
  writer.message(1, 100, "first");
  writer.message(1, 200, "second");
  writer.close_chunk();
  writer.message(1, 300, std::string(1000, 'x'));
  writer.message(1, 400, "fourth");
  writer.finish();
  return writer.bytes();
}

struct Found {
  McapScan scan;
  std::vector<std::string> contents;
  std::vector<McapPlace> places;
};

Found scan(const TemporaryFolder& folder, const std::string& bytes) {
  const FileBytes file(folder.write("a.mcap", bytes));
  Found found;
  found.scan = scan_mcap(file, [&](const McapMessage& m) {
    std::string content(m.place.size, '\0');
    EXPECT_TRUE(m.bytes->read(m.place.offset,
                              {reinterpret_cast<std::uint8_t*>(content.data()), content.size()}));
    EXPECT_EQ(m.channel->topic, "/left/image_raw");
    EXPECT_EQ(m.channel->type, "sensor_msgs/msg/Image");
    found.contents.push_back(content);
    found.places.push_back(m.place);
  });
  return found;
}

class McapOf : public ::testing::TestWithParam<const char*> {};

TEST_P(McapOf, MessagesComeInOrder) {
  const TemporaryFolder folder;
  const Found found = scan(folder, small_file(GetParam()));
  EXPECT_EQ(found.contents,
            (std::vector<std::string>{"first", "second", std::string(1000, 'x'), "fourth"}));
  EXPECT_TRUE(found.scan.finished);
  EXPECT_FALSE(found.scan.first_broken);
}

TEST_P(McapOf, MessageIsFoundAgainByItsPlace) {
  const TemporaryFolder folder;
  const Found found = scan(folder, small_file(GetParam()));
  const FileBytes file(folder / "a.mcap");
  const McapPlace place = found.places.at(3);
  std::string content(place.size, '\0');
  const std::span out(reinterpret_cast<std::uint8_t*>(content.data()), content.size());
  std::vector<std::uint8_t> records;
  if (place.chunk != McapPlace::kNoChunk) {
    ASSERT_TRUE(unpack_chunk(file, place.chunk, &records));
    ASSERT_TRUE(MemoryBytes(records).read(place.offset, out));
  } else {
    ASSERT_TRUE(file.read(place.offset, out));
  }
  EXPECT_EQ(content, "fourth");
}

TEST_P(McapOf, CutAnywhereGivesWholeChunksOnly) {
  const TemporaryFolder folder;
  const std::string whole = small_file(GetParam());
  std::size_t most = 0;
  for (std::size_t cut = 0; cut < whole.size(); ++cut) {
    if (cut < 8) {
      EXPECT_THROW(scan(folder, whole.substr(0, cut)), InputError) << cut;
      continue;
    }
    const Found found = scan(folder, whole.substr(0, cut));
    EXPECT_TRUE(found.contents.size() % 2 == 0 && found.contents.size() >= most) << cut;
    EXPECT_FALSE(found.scan.first_broken) << cut;
    most = found.contents.size();
  }
  EXPECT_EQ(most, 4U);
}

TEST_P(McapOf, AnyByteSetIsSurvived) {
  const TemporaryFolder folder;
  const std::string whole = small_file(GetParam());
  for (std::size_t i = 8; i < whole.size(); ++i)
    for (const char value : {'\x00', '\x7f', '\xff'}) {
      std::string spoilt = whole;
      spoilt[i] = value;
      const FileBytes file(folder.write("b.mcap", spoilt));
      std::size_t messages = 0;
      (void)scan_mcap(file, [&](const McapMessage& m) {
        std::vector<std::uint8_t> content(m.place.size);
        EXPECT_TRUE(m.bytes->read(m.place.offset, content)) << i;
        ++messages;
      });
      EXPECT_LE(messages, 4U) << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Compressions, McapOf, ::testing::Values("", "lz4", "zstd"));

TEST(Mcap, ChunkThatClaimsTooMuchIsSkippedWithASentence) {
  const TemporaryFolder folder;
  McapWriter writer;
  writer.channel(1, "/left/image_raw", "sensor_msgs/msg/Image");
  writer.close_chunk();
  const std::size_t here = writer.bytes().size();
  std::string head(16, '\0');
  head += std::string("\0\0\0\0\1\0\0\0", 8) + std::string(4, '\0') +
          std::string("\4\0\0\0zstd", 8) + std::string(8, '\0');
  writer.record(6, head);
  writer.message(1, 5, "after");
  writer.finish();
  const Found found = scan(folder, writer.bytes());
  EXPECT_EQ(found.contents, std::vector<std::string>{"after"});
  EXPECT_EQ(found.scan.broken_chunks, 1U);
  EXPECT_EQ(found.scan.first_broken, here);
  EXPECT_NE(found.scan.why_broken.find("larger than 64 MiB"), std::string::npos);
}

TEST(Mcap, MessageOfNoChannelIsCounted) {
  const TemporaryFolder folder;
  McapWriter writer;
  writer.message(7, 5, "whose");
  writer.finish();
  const Found found = scan(folder, writer.bytes());
  EXPECT_TRUE(found.contents.empty());
  EXPECT_EQ(found.scan.orphans, 1U);
}

}  // namespace
}  // namespace vergence::app::detail
