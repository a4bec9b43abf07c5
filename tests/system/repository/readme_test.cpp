// Checks that examples of the README work unchanged.
#include <gtest/gtest.h>

#include "app/config/calibration_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

std::string readme() {
  return test::read_file(std::filesystem::path(VERGENCE_SOURCE_DIR) / "README.md");
}

TEST(Readme, calibrationExampleIsRead) {
  const std::string text = readme();
  const std::string open = "```yaml\n";
  const std::size_t begin = text.find(open);
  ASSERT_NE(begin, std::string::npos);
  const std::size_t end = text.find("```", begin + open.size());
  const CalibrationFile file =
      parse_calibration(text.substr(begin + open.size(), end - begin - open.size()), "README.md");
  EXPECT_EQ(file.rig.cameras, 2);
  EXPECT_EQ(file.rig.intrinsics[1].width, 752);
  EXPECT_LT(file.rig.T_camera_left[1].t.x(), 0) << "the camera to the right";
  EXPECT_NEAR(file.rig.T_camera_left[1].t.norm(), file.rig.baseline, 1e-5);
}

}  // namespace
}  // namespace vergence::app
