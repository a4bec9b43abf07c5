// A drive whose cameras give nothing.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/live_drive.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

using test::Drive;

void expect_whole(const fs::path& session) {
  EXPECT_GT(test::summary_of(session)["frames"]["posed"].get<int>(), 0);
  EXPECT_TRUE(fs::exists(session / "report.html"));
}

TEST(Run, runEndsOnTimeWithoutAnyCamera) {
  const test::TemporaryFolder folder;
  Drive drive(folder / "s", false, 4,
              {"--quiet", "--fault", "camera_gone@2 camera=-1 duration_s=0"});
  EXPECT_EQ(drive.wait(60s), 3);
  expect_whole(folder / "s");
}

}  // namespace
}  // namespace vergence
