#include "app/datasets/detail/bag_scan.hpp"

#include <gtest/gtest.h>

#include "tests/support/bag_writer.hpp"

namespace vergence::app::detail {
namespace {

using test::RosbagWriter;

std::string u32(std::uint32_t v) {
  return {static_cast<char>(v), static_cast<char>(v >> 8U), static_cast<char>(v >> 16U),
          static_cast<char>(v >> 24U)};
}

struct Found {
  BagScan scan;
  std::vector<std::string> contents;
};

Found scan(const std::string& bytes) {
  const MemoryBytes file({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  Found found;
  const auto scan = scan_rosbag(file, [&](const BagMessage& m) {
    std::string content(m.place.size, '\0');
    EXPECT_TRUE(m.bytes->read(m.place.offset,
                              {reinterpret_cast<std::uint8_t*>(content.data()), content.size()}));
    found.contents.push_back(content);
  });
  found.scan = scan.value();
  return found;
}

const RosbagWriter::Fields kConnection{{"op", "\x07"}, {"conn", u32(1)}, {"topic", "/a"}};
const std::string kAbout = u32(10) + "type=a_m/B";
RosbagWriter::Fields message_of(std::uint32_t connection) {
  return {{"op", "\x02"}, {"conn", u32(connection)}, {"time", std::string(8, '\1')}};
}

// A recorder writes sizes into a chunk's head when it closes the chunk.
TEST(Rosbag, MessagesOfAChunkThatWasNeverClosedAreRead) {
  RosbagWriter writer;
  writer.record({{"op", "\x05"}, {"compression", "none"}, {"size", u32(0)}}, "");
  writer.record(kConnection, kAbout);
  writer.record(message_of(1), "first");
  const std::size_t end = writer.bytes().size();
  writer.record(message_of(1), "second");
  const Found found = scan(writer.bytes().substr(0, writer.bytes().size() - 1));
  EXPECT_EQ(found.contents, std::vector<std::string>{"first"});
  EXPECT_FALSE(found.scan.finished);
  EXPECT_EQ(found.scan.end, end);
  EXPECT_FALSE(found.scan.first_broken);
}

TEST(Rosbag, WithoutAnIndexItIsUnfinished) {
  RosbagWriter writer("lz4");
  writer.channel(1, "/a", "a_m/B");
  writer.message(1, 5, "first");
  writer.close_chunk();
  const Found found = scan(writer.bytes());
  EXPECT_EQ(found.contents.size(), 1U);
  EXPECT_FALSE(found.scan.finished);
  EXPECT_EQ(found.scan.end, writer.bytes().size());
}

// Offsets of the index, counts and places of chunks: nothing rests on them.
TEST(Rosbag, AnIndexThatLiesDoesNoHarm) {
  RosbagWriter writer("bz2");
  writer.channel(1, "/a", "a_m/B");
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
  EXPECT_EQ(scan(lies).contents, (std::vector<std::string>{"first", "second"}));
}

TEST(Rosbag, WhatContradictsItselfIsSkippedWithASentence) {
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
  const Found found = scan(writer.bytes());
  EXPECT_EQ(found.contents, std::vector<std::string>{"after"});
  EXPECT_EQ(found.scan.broken_chunks, 4U);
  EXPECT_EQ(found.scan.broken_records, 3U);
  EXPECT_EQ(found.scan.first_broken, here);
  EXPECT_NE(found.scan.why_broken.find("larger than 64 MiB"), std::string::npos);
}

}  // namespace
}  // namespace vergence::app::detail
