#include "app/session/session_quota.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

TEST(SessionQuota, removesOldestEndedSessions) {
  const test::TemporaryFolder folder;
  const auto make = [&](const std::string& name, bool ended, int age_h) {
    fs::create_directories(folder / name);
    folder.write(name + "/poses.csv", std::string(600, 'x'));
    if (!ended) return;
    folder.write(name + "/summary.json", std::string(400, 'x'));
    fs::last_write_time(folder / name / "summary.json",
                        fs::file_time_type::clock::now() - std::chrono::hours(age_h));
  };
  make("oldest", true, 3);
  make("older", true, 2);
  make("new", true, 1);
  make("cut_off", false, 0);
  make("now", true, 9);
  fs::create_directories(folder / "photos");
  folder.write("photos/summary.json", std::string(5000, 'x'));
  EXPECT_TRUE(keep_session_quota(folder / "now", 3000).empty()) << "three sessions of 1000 bytes";
  EXPECT_EQ(keep_session_quota(folder / "now/", 1500).size(), 2U);
  for (const char* removed : {"oldest", "older"})
    EXPECT_FALSE(fs::exists(folder / removed)) << removed;
  for (const char* stays : {"new", "cut_off", "now", "photos"})
    EXPECT_TRUE(fs::exists(folder / stays)) << stays;
  EXPECT_TRUE(keep_session_quota(folder / "nowhere" / "now", 0).empty());
}

}  // namespace
}  // namespace vergence::app
