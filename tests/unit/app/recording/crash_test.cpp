#include <string>

#include <gtest/gtest.h>

#include "tests/unit/app/recording/kill_check.hpp"

namespace vergence::app {
namespace {

using test::read_mcap;
using test::TemporaryFolder;

// At most 100 ms are lost where the writer gets the processor when it asks; a machine that runs
// other tests beside it may let it wait, which the median does not see.
TEST(CrashedRecording, readsBackUpToTheLast100MsAfterAKill) {
  const auto lost_ms = test::lost_before_kills(5);
  EXPECT_LE(lost_ms[2], 100);
  EXPECT_LE(lost_ms.back(), 1000);
}

/// A finished file of some 40 chunks.
std::string recorded(const TemporaryFolder& folder) {
  Recording::Options o;
  o.files.topics = {{"/text", RosType::text, false}};
  o.queues = {8U << 10U};  // a chunk each time that it is full
  o.when_full = Recording::WhenFull::wait;
  Recording recording(folder.path(), o);
  for (int n = 0; n < 2000; ++n) {
    CdrWriter out(recording.begin(0, 0, Stamp(n), 128));
    write_text(&out, std::to_string(n) + std::string(100, '.'));
    recording.commit(0, out.size());
  }
  recording.close();
  return test::read_file(folder / "drive.mcap");
}

TEST(CrashedRecording, everyTruncationReadsBackItsWholeChunks) {
  const TemporaryFolder folder;
  const std::string whole = recorded(folder);
  std::size_t last = 0;
  constexpr std::size_t kCuts = 1000;
  for (std::size_t i = 0; i <= kCuts; ++i) {
    const std::size_t size = 8 + (whole.size() - 8) * i / kCuts;
    const auto file = read_mcap(folder.write("cut.mcap", std::string_view(whole).substr(0, size)));
    EXPECT_EQ(file.scan.broken_chunks + file.scan.broken_records + file.scan.orphans, 0U);
    EXPECT_GE(file.messages.size(), last);  // never less of a longer file
    last = file.messages.size();
    for (std::size_t m = 0; m < file.messages.size(); m += 97)
      EXPECT_EQ(std::stoul(file.messages[m].content.substr(8)), m);
  }
  EXPECT_EQ(last, 2000U);
}

TEST(CrashedRecording, aFlippedBitCostsAtMostItsChunk) {
  const TemporaryFolder folder;
  const std::string whole = recorded(folder);
  for (std::size_t i = 0; i < 300; ++i) {
    std::string bytes = whole;
    const std::size_t at = 8 + (whole.size() - 9) * i / 300;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (i % 8)));
    // Read without a crash, and no more than was written.
    EXPECT_LE(read_mcap(folder.write("flipped.mcap", bytes)).messages.size(), 2000U);
  }
}

}  // namespace
}  // namespace vergence::app
