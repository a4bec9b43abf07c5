#include "app/session/given_calibration.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "app/runtime/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

const std::string kKalibr = R"(cam0:
  {camera_model: pinhole, distortion_model: none, distortion_coeffs: [], intrinsics: [460, 460, 320, 240], resolution: [640, 480]}
cam1:
  {camera_model: pinhole, distortion_model: none, distortion_coeffs: [], intrinsics: [461, 461, 321, 241], resolution: [640, 480],
   T_cn_cnm1: [[1, 0, 0, -0.3], [0, 1, 0, 0.003], [0, 0, 1, 0], [0, 0, 0, 1]]}
)";

const std::string kOpenCv = R"(cameraMatrix1: [[460, 0, 320], [0, 460, 240], [0, 0, 1]]
cameraMatrix2: [[461, 0, 321], [0, 461, 241], [0, 0, 1]]
distCoeffs1: [0, 0, 0, 0]
distCoeffs2: [0, 0, 0, 0]
R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
T: [-0.3, 0, 0]
)";

const std::string kOurs = R"({version: 1, cameras: [
{size: [640, 480], model: pinhole-radtan, intrinsics: [460, 460, 320, 240]},
{size: [640, 480], model: pinhole-radtan, intrinsics: [461, 461, 321, 241], T_camera_left: [1, 0, 0, -0.3, 0, 1, 0, 0, 0, 0, 1, 0]}]}
)";

CalibrationFile read(const std::filesystem::path& file, const CalibrationUse& use = {}) {
  std::vector<std::string> remarks;
  return read_given_calibration(file.string(), use, ImageSize{640, 480}, &remarks);
}

TEST(GivenCalibration, theBaselineOfTheCommandLineCountsForEveryFormat) {
  const test::TemporaryFolder folder;
  for (const auto& [name, text] :
       {std::pair{"chain.yaml", kKalibr}, {"stereo.yml", kOpenCv}, {"ours.yaml", kOurs}}) {
    const auto file = folder.write(name, text);
    const RigCalibration rig = read(file, {.baseline = 0.6}).rig;
    EXPECT_EQ(rig.baseline, 0.6) << name;
    EXPECT_NEAR(rig.T_camera_left[1].t.norm(), 0.6, 1e-12) << name;
    EXPECT_EQ(read(file, {.length_only = true}).rig.T_camera_left[1].t.y(), 0)
        << name << ": from scratch no place is read";
  }
}

}  // namespace
}  // namespace vergence::app
