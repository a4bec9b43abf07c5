#include "app/session/session_quota.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <string>

#include "app/recorder/record_lines.hpp"
#include "app/recorder/session_folder.hpp"
#include "tests/support/small_disk.hpp"
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
  for (const char* file : {"poses.csv", "summary.json"})
    if (fs::exists(folder / file))
      fs::last_write_time(folder / file,
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
  const SessionMark running(0, (folder / "sessions" / "running").c_str());
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

TEST(SessionQuota, aSessionThatIsLockedStaysHoweverOld) {
  const test::TemporaryFolder folder;
  for (const bool ended : {false, true}) {
    make_session(folder / "locked", 1000, ended);
    {
      const SessionMark mark(0, (folder / "locked").c_str());
      EXPECT_TRUE(keep_session_quota(folder / "now", 0).empty());
      EXPECT_TRUE(fs::exists(folder / "locked" / "poses.csv"));
    }
    EXPECT_EQ(keep_session_quota(folder / "now", 0).size(), 1U) << "its lock goes with it";
    EXPECT_FALSE(fs::exists(folder / "locked"));
  }
}

TEST(SessionQuota, theOrderIsThatOfDrivingWhateverTheClockSaid) {
  const test::TemporaryFolder folder;
  const auto numbered = [&folder](const char* name, std::uint64_t number, int hours) {
    make_session(folder / name, hours);
    const SessionMark mark(number, (folder / name).c_str());
  };
  numbered("first", 9, 1);
  numbered("second", 10, 2000);
  numbered("third", 11, 500);
  make_session(folder / "of_old", 3);
  std::ofstream(folder / "of_old" / SessionMark::kFile);  // a power cut left nothing in it
  EXPECT_EQ(next_session_number(folder / "now"), 12U);
  EXPECT_EQ(keep_session_quota(folder / "now", 2 * kSize + 5000).size(), 2U);
  EXPECT_FALSE(fs::exists(folder / "of_old"));
  EXPECT_FALSE(fs::exists(folder / "first"));
  EXPECT_EQ(keep_session_quota(folder / "now", kSize + 5000).size(), 1U);
  EXPECT_FALSE(fs::exists(folder / "second"));
  EXPECT_TRUE(fs::exists(folder / "third"));
}

/// Somebody who may remove nothing from a folder without write permission, which root may.
class Unprivileged {
 public:
  explicit Unprivileged(const fs::path& owned) : root_(::geteuid() == 0) {
    if (!root_) return;
    ready_ = ::chown(owned.c_str(), kNobody, kNobody) == 0;
    for (const auto& entry : fs::recursive_directory_iterator(owned))
      ready_ = ready_ && ::chown(entry.path().c_str(), kNobody, kNobody) == 0;
    ready_ = ready_ && ::seteuid(kNobody) == 0;
  }
  ~Unprivileged() {
    if (root_) (void)::seteuid(0);
  }
  Unprivileged(const Unprivileged&) = delete;
  Unprivileged& operator=(const Unprivileged&) = delete;
  [[nodiscard]] bool ready() const { return ready_; }

 private:
  static constexpr uid_t kNobody = 65534;
  bool root_, ready_ = true;
};

TEST(SessionQuota, oneThatCannotGoStaysASessionAndCostsNoNewerOne) {
  const test::TemporaryFolder folder;
  make_session(folder / "stuck", 9);
  make_session(folder / "older", 5);
  make_session(folder / "newer", 3);
  fs::permissions(folder / "stuck" / "more", fs::perms::owner_read | fs::perms::owner_exec);
  {
    const Unprivileged user(folder.path());
    if (!user.ready()) GTEST_SKIP() << "the tests run as a root who cannot become somebody else";
    const auto sentences = keep_session_quota(folder / "now", kSize + 5000);
    ASSERT_EQ(sentences.size(), 2U);
    EXPECT_NE(sentences[0].find("/stuck: is over"), std::string::npos) << sentences[0];
    EXPECT_NE(sentences[1].find("/older: removed"), std::string::npos) << sentences[1];
    EXPECT_TRUE(fs::exists(folder / "newer"));
    EXPECT_TRUE(fs::exists(folder / "stuck" / "poses.csv")) << "what is left would be no session";
  }
  fs::permissions(folder / "stuck" / "more", fs::perms::owner_all);
  EXPECT_EQ(keep_session_quota(folder / "now", kSize + 5000).size(), 1U);
  EXPECT_FALSE(fs::exists(folder / "stuck")) << "cut short once, it goes the next time";
}

}  // namespace
}  // namespace vergence::app
