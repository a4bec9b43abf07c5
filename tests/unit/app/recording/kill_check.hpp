#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/recording_reader.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/recording/killed_recording.hpp"

namespace vergence::test {

/// Kills a recording `kills` times; every message up to the last one that is there reads back.
/// → ms before each kill from which on messages are lost
inline std::vector<double> lost_before_kills(int kills) {
  std::vector<double> lost_ms;
  for (int i = 0; i < kills; ++i) {
    const TemporaryFolder folder;
    // 7919 is prime: moments all over the rhythm of the chunks
    const Killed killed =
        record_and_kill(folder.path(), std::chrono::microseconds(50'000 + 7919 * i % 400'000));
    const ReadFile file = read_mcap(folder / "drive.mcap");
    EXPECT_EQ(file.scan.broken_chunks + file.scan.broken_records + file.scan.orphans, 0U);
    std::size_t texts = 0, images = 0;
    for (const ReadMessage& m : file.messages) {
      if (m.topic == "/image") {
        ++images;
        continue;
      }
      EXPECT_EQ(std::stoul(m.content.substr(8)), texts);
      EXPECT_EQ(m.content.size(), 8 + std::to_string(texts).size() + 101);
      ++texts;
    }
    EXPECT_EQ(images, (texts + 32) / 33);
    lost_ms.push_back(texts >= killed.at.size()
                          ? 0.0
                          : static_cast<double>(killed.killed_ns - killed.at[texts]) * 1e-6);
  }
  std::sort(lost_ms.begin(), lost_ms.end());
  return lost_ms;
}

}  // namespace vergence::test
