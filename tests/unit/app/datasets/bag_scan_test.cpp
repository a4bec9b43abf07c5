#include "app/datasets/detail/bag_scan.hpp"

#include "tests/support/bag_writer.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app::detail {
namespace {

using test::BagKind;
using test::RosbagWriter;

/// Two chunks of two messages each.
std::string small_file(const BagKind& kind) {
  const auto writer = kind.writer();
  writer->channel(1, "/left/image_raw", "sensor_msgs/Image");
  writer->message(1, 100, "first");
  writer->message(1, 200, "second");
  writer->close_chunk();
  writer->message(1, 300, std::string(1000, 'x'));
  writer->message(1, 400, "fourth");
  writer->finish();
  return writer->bytes();
}

struct Found {
  BagScan scan;
  std::vector<std::string> contents;
};

BagFormat format_of(const BagKind& kind) {
  return kind.is_mcap() ? BagFormat::mcap : BagFormat::rosbag;
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Nothing: it does not begin as the kind does.
std::optional<Found> scan(const BagKind& kind, const std::string& bytes) {
  Found found;
  const auto scan =
      scan_bag(format_of(kind), MemoryBytes(bytes_of(bytes)), [&](const BagMessage& m) {
        std::string content(m.place.size, '\0');
        EXPECT_TRUE(m.bytes->read(
            m.place.offset, {reinterpret_cast<std::uint8_t*>(content.data()), content.size()}));
        EXPECT_EQ(m.channel->topic, "/left/image_raw");
        EXPECT_EQ(m.channel->type, "sensor_msgs/Image");
        EXPECT_EQ(m.channel->encoding,
                  kind.is_mcap() ? MessageEncoding::cdr : MessageEncoding::ros1);
        found.contents.push_back(content);
      });
  if (!scan) return std::nullopt;
  found.scan = *scan;
  return found;
}

class BagScanOf : public ::testing::TestWithParam<BagKind> {};

TEST_P(BagScanOf, deliversMessagesInOrder) {
  const Found found = scan(GetParam(), small_file(GetParam())).value();
  EXPECT_EQ(found.contents,
            (std::vector<std::string>{"first", "second", std::string(1000, 'x'), "fourth"}));
  EXPECT_TRUE(found.scan.finished);
  EXPECT_FALSE(found.scan.first_broken);
  EXPECT_EQ(found.scan.orphans, 0U);
}

TEST_P(BagScanOf, truncatedBagGivesCompleteChunksOnly) {
  const std::string whole = small_file(GetParam());
  const std::size_t magic = GetParam().is_mcap() ? 8 : 13;
  std::size_t most = 0;
  for (std::size_t cut = 0; cut < whole.size(); ++cut) {
    const auto got = scan(GetParam(), whole.substr(0, cut));
    ASSERT_EQ(got.has_value(), cut >= magic) << cut;
    if (!got) continue;
    const Found& found = *got;
    EXPECT_TRUE(found.contents.size() % 2 == 0 && found.contents.size() >= most) << cut;
    EXPECT_FALSE(found.scan.first_broken) << cut;
    EXPECT_LE(found.scan.end, cut);
    EXPECT_TRUE(!found.scan.finished || found.contents.size() == 4) << cut;
    most = found.contents.size();
  }
  EXPECT_EQ(most, 4U);
}

TEST_P(BagScanOf, survivesAnyChangedByte) {
  const std::string whole = small_file(GetParam());
  for (std::size_t i = 8; i < whole.size(); ++i) {
    // Blanks pad the first record of a ROS 1 bag.
    if (whole[i] == ' ') continue;
    for (const char value : {'\x00', '\x7f', '\xff'}) {
      std::string spoilt = whole;
      spoilt[i] = value;
      const MemoryBytes file(bytes_of(spoilt));
      std::size_t messages = 0;
      const auto scan = scan_bag(format_of(GetParam()), file, [&](const BagMessage& m) {
        std::vector<std::uint8_t> content(m.place.size);
        EXPECT_TRUE(m.bytes->read(m.place.offset, content)) << i;
        ++messages;
      });
      EXPECT_TRUE(scan || i < 13) << "of what a bag begins with";
      EXPECT_LE(messages, 4U) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, BagScanOf,
                         ::testing::Values(BagKind{"mcap", ""}, BagKind{"mcap", "lz4"},
                                           BagKind{"mcap", "zstd"}, BagKind{"rosbag", "none"},
                                           BagKind{"rosbag", "lz4"}, BagKind{"rosbag", "bz2"}));

TEST(Mcap, skipsChunkWithExcessiveSize) {
  test::McapWriter writer;
  writer.channel(1, "/left/image_raw", "sensor_msgs/Image");
  writer.close_chunk();
  const std::size_t here = writer.bytes().size();
  std::string head(16, '\0');
  head += std::string("\0\0\0\0\1\0\0\0", 8) + std::string(4, '\0') +
          std::string("\4\0\0\0zstd", 8) + std::string(8, '\0');
  writer.record(6, head);
  writer.message(1, 5, "after");
  writer.finish();
  const Found found = scan({"mcap", ""}, writer.bytes()).value();
  EXPECT_EQ(found.contents, std::vector<std::string>{"after"});
  EXPECT_EQ(found.scan.skipped, 1U);
  EXPECT_EQ(found.scan.first_broken, here);
  EXPECT_TRUE(test::mentions(found.scan.why_broken, "larger than 64 MiB"));
}

TEST(Mcap, countsMessagesWithoutChannel) {
  for (const BagKind& kind : {BagKind{"mcap", ""}, BagKind{"rosbag", "none"}}) {
    const auto writer = kind.writer();
    writer->message(7, 5, "whose");
    writer->finish();
    const Found found = scan(kind, writer->bytes()).value();
    EXPECT_TRUE(found.contents.empty());
    EXPECT_EQ(found.scan.orphans, 1U);
  }
}

std::string u32(std::uint32_t v) { return test::number(v, 4); }
Found scan_rosbag_of(const std::string& bytes) { return scan({"rosbag", "none"}, bytes).value(); }

const RosbagWriter::Fields kConnection{
    {"op", "\x07"}, {"conn", u32(1)}, {"topic", "/left/image_raw"}};
const std::string kAbout = u32(22) + "type=sensor_msgs/Image";
RosbagWriter::Fields message_of(std::uint32_t connection) {
  return {{"op", "\x02"}, {"conn", u32(connection)}, {"time", std::string(8, '\1')}};
}

// A recorder writes sizes into a chunk's head when it closes the chunk.
TEST(Rosbag, readsMessagesOfUnclosedChunk) {
  RosbagWriter writer;
  writer.record({{"op", "\x05"}, {"compression", "none"}, {"size", u32(0)}}, "");
  writer.record(kConnection, kAbout);
  writer.record(message_of(1), "first");
  const std::size_t end = writer.bytes().size();
  writer.record(message_of(1), "second");
  const Found found = scan_rosbag_of(writer.bytes().substr(0, writer.bytes().size() - 1));
  EXPECT_EQ(found.contents, std::vector<std::string>{"first"});
  EXPECT_FALSE(found.scan.finished);
  EXPECT_EQ(found.scan.end, end);
  EXPECT_FALSE(found.scan.first_broken);
}

// Offsets of the index, counts and places of chunks: nothing rests on them.
TEST(Rosbag, survivesWrongIndex) {
  RosbagWriter writer("bz2");
  writer.channel(1, "/left/image_raw", "sensor_msgs/Image");
  for (const char* content : {"first", "second"}) {
    writer.message(1, 5, content);
    writer.close_chunk();
  }
  writer.finish();
  std::string lies = writer.bytes();
  for (std::size_t at = lies.find("chunk_pos="); at != std::string::npos;
       at = lies.find("chunk_pos=", at + 1))
    lies.replace(at + 10, 8, "\xff\xff\xff\xff\xff\xff\xff\x7f");
  for (std::size_t at = lies.find("count="); at != std::string::npos;
       at = lies.find("count=", at + 1))
    lies.replace(at + 6, 4, "\xff\xff\xff\xff");
  lies.replace(lies.find("index_pos=") + 10, 8, "\x01\x01\x01\x01\x01\x01\x01\x01");
  ASSERT_NE(lies, writer.bytes());
  EXPECT_EQ(scan_rosbag_of(lies).contents, (std::vector<std::string>{"first", "second"}));
}

TEST(Rosbag, skipsContradictoryRecords) {
  RosbagWriter writer;
  writer.record(kConnection, kAbout);
  const std::size_t here = writer.bytes().size();
  writer.record({{"op", "\x05"}, {"compression", "lz4"}, {"size", u32(0xffffffff)}}, "x");
  writer.record({{"op", "\x05"}, {"compression", "gzip"}, {"size", u32(9)}}, "x");
  writer.record({{"op", "\x05"}, {"compression", "bz2"}}, "x");
  writer.record({{"op", "\x05"}, {"compression", "bz2"}, {"size", u32(9)}}, "x");
  writer.record({{"op", "\x07"}, {"conn", u32(2)}}, kAbout);
  writer.record({{"op", "\x02"}}, "of no connection");
  writer.record({{"no op", ""}}, "");
  writer.record(message_of(1), "after");
  const Found found = scan_rosbag_of(writer.bytes());
  EXPECT_EQ(found.contents, std::vector<std::string>{"after"});
  EXPECT_EQ(found.scan.skipped, 7U);
  EXPECT_EQ(found.scan.first_broken, here);
  EXPECT_TRUE(test::mentions(found.scan.why_broken, "larger than 64 MiB"));
}

}  // namespace
}  // namespace vergence::app::detail
