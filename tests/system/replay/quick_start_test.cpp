// Mistakes of the first day with the program, on recorded images.

#include <fmt/format.h>

#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/system/replay/quick_start.hpp"

namespace vergence::test {
namespace {

constexpr const char* kRaw = "data/kitti_raw_0039_20/2011_09_26/2011_09_26_drive_0039_extract";

std::string times_at_ten_hertz(int count) {
  std::string times;
  for (int i = 0; i < count; ++i) times += fmt::format("{:.1f}\n", 0.1 * i);
  return times;
}

TEST_F(QuickStart, missingDistortionExitsOneAndIsNamed) {
  const auto folder = shared_data(kRaw);
  if (!folder) GTEST_SKIP() << shared_data_missing(kRaw);
  // Focal lengths, centres and transform of calib_cam_to_cam.txt, but no distortion.
  const fs::path data =
      plain(*folder / "image_00/data", *folder / "image_01/data", times_at_ten_hertz(20),
            "version: 1\ncameras:\n"
            "  - {size: [1392, 512], model: pinhole-radtan, intrinsics: [984.2439, 980.8141, "
            "690.0, 233.1966], distortion: [0, 0, 0, 0]}\n"
            "  - {size: [1392, 512], model: pinhole-radtan, intrinsics: [989.5267, 987.8386, "
            "702.0, 245.559], distortion: [0, 0, 0, 0],\n"
            "     T_camera_left: [0.9993513, 0.01860866, -0.03083487, -0.537, -0.01887662, "
            "0.9997863, -0.008421873, 0.004822061, 0.03067156, "
            "0.008998467, 0.999489, -0.01252488]}\n");
  const Outcome o = replay(data, "");
  EXPECT_EQ(o.code, 1) << o.err;
  EXPECT_TRUE(test::mentions(o.err, "distortion"));
  EXPECT_TRUE(test::mentions(report(), "Do not use"));
}

std::string euroc_calibration(const std::string& T) {
  return "version: 1\ncameras:\n"
         "  - {size: [752, 480], model: pinhole-radtan, intrinsics: [458.654, 457.296, 367.215, "
         "248.375], distortion: [-0.2834, 0.0740, 0.0002, 0.0]}\n"
         "  - {size: [752, 480], model: pinhole-radtan, intrinsics: [457.587, 456.134, 379.999, "
         "255.238], distortion: [-0.2837, 0.0745, -0.0001, 0.0],\n     T_camera_left: [" +
         T + "]}\n";
}

std::string euroc_times() {
  std::string times;
  for (int i = 0; i < 105; ++i) times += fmt::format("{:.2f}\n", 0.05 * i);
  return times;
}

TEST_F(QuickStart, transposedRotationIsReportedAsInverted) {
  const auto folder = shared_data("data/euroc_mh01/mav0");
  if (!folder) GTEST_SKIP() << shared_data_missing("data/euroc_mh01/mav0");
  const fs::path data = plain(
      *folder / "cam0/data", *folder / "cam1/data", euroc_times(),
      euroc_calibration(
          "0.999997, -0.002317, -0.000343, -0.110074, 0.002312, 0.999898, -0.014091, 0.000399, "
          "0.000376, 0.014090, 0.999901, -0.000854"));
  // A longer drive finds the right one itself.
  const Outcome o = replay(data, "--frames 60");
  EXPECT_EQ(o.code, 1) << o.err;
  EXPECT_TRUE(test::mentions(o.err, "T_camera_left or its rotation may be inverted"));
}

}  // namespace
}  // namespace vergence::test
