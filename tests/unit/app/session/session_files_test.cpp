#include "app/session/session_files.hpp"

#include <filesystem>
#include <optional>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

CalibrationFile two_cameras() {
  CalibrationFile file;
  RigCalibration& rig = file.rig;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k] = {.width = 160, .height = 120, .fx = 100, .fy = 100, .cx = 80, .cy = 60};
  rig.T_camera_left[1].t = {-0.5, 0, 0};
  rig.baseline = 0.5;
  return file;
}

/// What is said of a calibration that was found, where files cannot be written.
Kept kept(bool session_fails, bool has_state, bool state_fails) {
  const test::TemporaryFolder folder;
  const auto in_the_way = [&](const char* file) {
    std::filesystem::create_directories(folder / (std::string(file) + ".new"));
  };
  std::filesystem::create_directory(folder / "session");
  if (session_fails) in_the_way("session/calibration.yaml");
  if (state_fails) in_the_way("state.yaml");
  const CalibrationFile file = two_cameras();
  const auto state = has_state ? std::optional(folder / "state.yaml") : std::nullopt;
  const Kept kept = calibration_keeper(folder / "session", file, state)(file.rig, true);
  EXPECT_EQ(std::filesystem::exists(folder / "state.yaml"), has_state && !state_fails);
  return kept;
}

TEST(CalibrationKeeper, whetherItIsKeptIsWhetherTheNextDriveHasIt) {
  EXPECT_TRUE(kept(false, false, false).sentence.empty());
  EXPECT_FALSE(kept(false, true, false).failed);
  EXPECT_TRUE(kept(false, true, true).failed);
  EXPECT_TRUE(kept(true, true, true).failed);
  EXPECT_TRUE(kept(true, false, false).failed) << "the session's is all there is to keep";

  const Kept here = kept(true, true, false);
  EXPECT_FALSE(here.failed);
  EXPECT_TRUE(here.sentence.starts_with("the calibration is kept for the next drive: "))
      << here.sentence;
  EXPECT_NE(here.sentence.find("session/calibration.yaml"), std::string::npos) << here.sentence;
}

}  // namespace
}  // namespace vergence::app
