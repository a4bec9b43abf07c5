#include "app/session/starting_calibration.hpp"

#include "app/config/calibration_state.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/app/session/recorder_inputs.hpp"

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

TEST(StartingCalibration, scratchPrecedesFileAndState) {
  const test::TemporaryFolder folder;
  const Configuration c = configuration(folder);
  write_state(folder / "calibration_state.yaml", found(c, 0.011));
  write_calibration(folder / "mine.yaml", found(c, 0.022));
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

TEST(StartingCalibration, aCameraExchangedBehindItsAddressIsNoticed) {
  const test::TemporaryFolder folder;
  Configuration c = configuration(folder, "gige");
  c.cameras[0].serial = "192.168.7.2";
  const StartingCalibration first = starting_calibration(c, {}, {"4711", ""});
  EXPECT_EQ(first.file.serials[0], "4711") << "the device's own, not its address";
  c.cameras[1].serial = "/dev/video1";
  EXPECT_EQ(starting_calibration(c, {}, {"4711", ""}).file.serials[1], "/dev/video1")
      << "one without a serial is what it is asked for";

  const auto drive = [&](const char* own) { return starting_calibration(c, {}, {own, ""}); };
  write_state(folder / "calibration_state.yaml", drive("4711").file);
  EXPECT_EQ(drive("4711").trust, CalibrationTrust::state_file);
  const StartingCalibration other = drive("4712");
  EXPECT_EQ(other.trust, CalibrationTrust::given);
  ASSERT_EQ(other.remarks.size(), 1U);
  EXPECT_TRUE(test::mentions(other.remarks[0], "\"4711\", the connected one \"4712\""));
}

TEST(StartingCalibration, realCamerasWithoutAPlaceBeginFromScratch) {
  const test::TemporaryFolder folder;
  Configuration c = configuration(folder, "gige");
  EXPECT_EQ(starting_calibration(c, {}, kSerials).trust, CalibrationTrust::given)
      << "the configuration has places";
  c.cameras[1].T_camera_left = {};
  EXPECT_EQ(starting_calibration(c, {}, kSerials).trust, CalibrationTrust::none);
  write_state(folder / "calibration_state.yaml", found(c, 0.011));
  EXPECT_EQ(starting_calibration(c, {}, kSerials).trust, CalibrationTrust::state_file);
}

}  // namespace
}  // namespace vergence::app
