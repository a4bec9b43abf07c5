#include "app/session/session_quota.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>

#include "app/recorder/pose_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSize = 10'000;  // bytes of each session, and a bit

/// A session that was written so many hours ago.
void make_session(const fs::path& folder, int hours, bool ended = true) {
  fs::create_directories(folder / "more");
  std::ofstream(folder / "poses.csv") << kPosesHeader << "\n";
  std::ofstream(folder / "more" / "drive.mcap") << std::string(kSize, 'x');
  if (ended) std::ofstream(folder / "summary.json") << "{}";
  fs::last_write_time(folder / "poses.csv",
                      fs::file_time_type::clock::now() - std::chrono::hours(hours));
}

TEST(SessionQuota, theOldestGoUntilTheRestFits) {
  const test::TemporaryFolder folder;
  make_session(folder / "b", 3);
  make_session(folder / "a", 2);
  make_session(folder / "c", 4);
  make_session(folder / "now", 0, false);
  const auto sentences = keep_session_quota(folder / "now", 2 * kSize + 5000);
  ASSERT_EQ(sentences.size(), 1U);
  EXPECT_NE(sentences[0].find("/c: removed"), std::string::npos) << sentences[0];
  EXPECT_FALSE(fs::exists(folder / "c"));
  for (const char* kept : {"a", "b", "now"}) EXPECT_TRUE(fs::exists(folder / kept)) << kept;
}

TEST(SessionQuota, whatIsNoSessionARunningDriveALinkAndTheSessionItselfStay) {
  const test::TemporaryFolder folder;
  make_session(folder / "elsewhere" / "linked", 9);
  make_session(folder / "sessions" / "running", 0, false);
  make_session(folder / "sessions" / "now", 8);
  make_session(folder / "sessions" / "killed", 5, false);
  fs::create_directories(folder / "sessions" / "photos");
  std::ofstream(folder / "sessions" / "photos" / "poses.csv") << "frame,who\n";
  fs::create_directory_symlink(folder / "elsewhere" / "linked", folder / "sessions" / "linked");
  const auto sentences = keep_session_quota(folder / "sessions" / "now", 0);
  ASSERT_EQ(sentences.size(), 1U);
  EXPECT_FALSE(fs::exists(folder / "sessions" / "killed"));
  for (const char* kept : {"running", "now", "photos", "linked"})
    EXPECT_TRUE(fs::exists(folder / "sessions" / kept)) << kept;
  EXPECT_TRUE(fs::exists(folder / "elsewhere" / "linked" / "poses.csv"));
}

TEST(SessionQuota, aPathThatEndsWithASlashIsTheSameSession) {
  const test::TemporaryFolder folder;
  make_session(folder / "now", 2);
  EXPECT_TRUE(keep_session_quota((folder / "now").string() + "/", 0).empty());
  EXPECT_TRUE(fs::exists(folder / "now"));
}

}  // namespace
}  // namespace vergence::app
