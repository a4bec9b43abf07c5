// A drive whose cameras give nothing.
#include <gtest/gtest.h>

#include <chrono>

#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/live_drive.hpp"

namespace vergence {
namespace {

using namespace std::chrono_literals;

TEST(Run, runEndsOnTimeWithoutAnyCamera) {
  const test::TemporaryFolder folder;
  test::Drive drive(folder / "s", false, 4,
                    {"--quiet", "--fault", "camera_gone@2 camera=-1 duration_s=0"});
  EXPECT_EQ(drive.wait(60s), 3);
  EXPECT_GT(test::summary_of(folder / "s")["frames"]["posed"].get<int>(), 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "s" / "report.html"));
}

}  // namespace
}  // namespace vergence
