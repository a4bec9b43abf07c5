#include "app/commands/starting_calibration.hpp"

#include <gtest/gtest.h>

#include <string>

#include "app/config/calibration_state.hpp"
#include "app/runtime/errors.hpp"
#include "core/math/so3.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

const std::vector<std::string> kSerials{"m-0", "m-1"};

/// Two cameras with places of their own, and a state folder.
Configuration configuration(const test::TemporaryFolder& folder,
                            const std::string& driver = "mock") {
  return parse_configuration(
      "rig: {name: van, state_dir: \"" + folder.path().string() +
          "\"}\n"
          "cameras:\n"
          "  - {driver: " +
          driver + ", name: links, serial: A1}\n  - {driver: " + driver +
          ", T_camera_left: [1, 0, 0, -0.75, 0, 1, 0, 0.001, 0, 0, 1, 0.002]}\n",
      "drive.yaml", {});
}

CalibrationFile expected_of(const Configuration& c) {
  return starting_calibration(c, {.from_scratch = true}, kSerials).file;
}

/// A calibration of that rig, recognised by its t_y.
CalibrationFile found(const Configuration& c, double t_y) {
  CalibrationFile file = expected_of(c);
  file.rig.T_camera_left[1].t = {-0.75, t_y, 0.003};
  file.source = "online";
  return file;
}

TEST(StartingCalibration, isTheConfigurationsWhereNothingElseIsSaid) {
  const test::TemporaryFolder folder;
  const StartingCalibration start = starting_calibration(configuration(folder), {}, kSerials);
  EXPECT_EQ(start.trust, CalibrationTrust::given);
  EXPECT_EQ(start.file.rig.T_camera_left[1].t, Vec3(-0.75, 0.001, 0.002));
  EXPECT_EQ(start.file.names[0], "links");
  EXPECT_EQ(start.file.names[1], "right");
  EXPECT_EQ(start.file.serials[0], "A1") << "the configuration's";
  EXPECT_EQ(start.file.serials[1], "m-1") << "the device's";
  EXPECT_EQ(start.state, folder / "calibration_state.yaml");
  EXPECT_TRUE(start.remarks.empty());
}

TEST(StartingCalibration, fromScratchBeatsTheFileBeatsTheStateBeatsTheConfiguration) {
  const test::TemporaryFolder folder;
  const Configuration c = configuration(folder);
  write_state(folder / "calibration_state.yaml", found(c, 0.011));
  const StartingCalibration state = starting_calibration(c, {}, kSerials);
  EXPECT_EQ(state.trust, CalibrationTrust::unconfirmed);
  EXPECT_EQ(state.file.rig.T_camera_left[1].t.y(), 0.011);
  EXPECT_STREQ(state.cause, "state_file");

  write_calibration(folder / "mine.yaml", found(c, 0.022));
  const StartingCalibration given =
      starting_calibration(c, {.file = folder / "mine.yaml"}, kSerials);
  EXPECT_EQ(given.trust, CalibrationTrust::given);
  EXPECT_EQ(given.file.rig.T_camera_left[1].t.y(), 0.022);
  EXPECT_EQ(given.source, "mine.yaml");

  for (const CalibrationSource& wish :
       {CalibrationSource{.from_scratch = true}, CalibrationSource{true, folder / "mine.yaml"}}) {
    const StartingCalibration scratch = starting_calibration(c, wish, kSerials);
    EXPECT_EQ(scratch.trust, CalibrationTrust::none);
    EXPECT_EQ(scratch.file.rig.T_camera_left[1].R, Mat3(Mat3::Identity()));
    EXPECT_EQ(scratch.file.rig.T_camera_left[1].t.y(), 0)
        << "no place of an old calibration is read";
    EXPECT_NEAR(scratch.file.rig.baseline, 0.75, 1e-4);
    EXPECT_TRUE(scratch.state) << "what is found is kept";
  }
}

TEST(StartingCalibration, aStateOfOtherCamerasIsARemarkAndNotUsed) {
  const test::TemporaryFolder folder;
  const Configuration c = configuration(folder);
  write_state(folder / "calibration_state.yaml", found(c, 0.011));
  const StartingCalibration start = starting_calibration(c, {}, {"m-0", "another"});
  EXPECT_EQ(start.trust, CalibrationTrust::given);
  EXPECT_EQ(start.file.rig.T_camera_left[1].t.y(), 0.001);
  ASSERT_EQ(start.remarks.size(), 1U);
  EXPECT_NE(start.remarks[0].find("another"), std::string::npos) << start.remarks[0];
}

TEST(StartingCalibration, aFileOfAnotherRigIsRefused) {
  const test::TemporaryFolder folder;
  const Configuration c = configuration(folder);
  CalibrationFile other = found(c, 0);
  for (Intrinsics& lens : other.rig.intrinsics) lens.width = 800;
  write_calibration(folder / "other.yaml", other);
  EXPECT_THROW((void)starting_calibration(c, {.file = folder / "other.yaml"}, kSerials),
               InputError);
  EXPECT_THROW((void)starting_calibration(c, {.file = folder / "none.yaml"}, kSerials), InputError);
}

TEST(StartingCalibration, realCamerasWithoutAPlaceBeginFromScratch) {
  const test::TemporaryFolder folder;
  Configuration c = configuration(folder, "gige");
  EXPECT_EQ(starting_calibration(c, {}, kSerials).trust, CalibrationTrust::given)
      << "the configuration has places";
  c.cameras[1].T_camera_left = {};
  EXPECT_EQ(starting_calibration(c, {}, kSerials).trust, CalibrationTrust::none);
  write_state(folder / "calibration_state.yaml", found(c, 0.011));
  EXPECT_EQ(starting_calibration(c, {}, kSerials).trust, CalibrationTrust::unconfirmed);
}

TEST(NominalGeometry, isParallelButForCamerasMountedFartherThanTheGates) {
  RigCalibration mounted;
  mounted.cameras = 3;
  mounted.T_camera_left[1] = {exp_so3({0, 0.05, 0}), Vec3(-0.5, 0.01, 0)};
  mounted.T_camera_left[2] = {exp_so3({0.5, 0, 0}), Vec3(0, -0.3, 0)};  // below, looking up
  mounted.baseline = mounted.T_camera_left[1].t.norm();
  RigCalibration given = mounted;
  given.baseline = 2 * mounted.baseline;  // measured twice too long
  const RigCalibration nominal = nominal_geometry(given, mounted, {});
  EXPECT_EQ(nominal.T_camera_left[1].R, Mat3(Mat3::Identity()));
  EXPECT_EQ(nominal.T_camera_left[1].t, Vec3(-given.baseline, 0, 0));
  EXPECT_EQ(nominal.T_camera_left[2].R, mounted.T_camera_left[2].R);
  EXPECT_TRUE(nominal.T_camera_left[2].t.isApprox(2 * mounted.T_camera_left[2].t, 1e-12));
}

}  // namespace
}  // namespace vergence::app
