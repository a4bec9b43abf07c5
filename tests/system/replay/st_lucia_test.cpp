#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "app/config/calibration_file.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "app/devices/rig_settings.hpp"
#include "tests/support/st_lucia_writer.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

const std::string kRig = std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock_st_lucia.yaml";
constexpr double kSeconds = 8;

// The paper's rig in a quarter of its pixels, with an INS without errors. The calibration is the
// one given throughout: what is compared is the way of images and stamps through files.
const std::vector<std::string> kSmall{"cameras.0.size=[320, 240]",
                                      "cameras.1.size=[320, 240]",
                                      "cameras.0.intrinsics=[390, 390, 160, 120]",
                                      "cameras.1.intrinsics=[390, 390, 158, 121]",
                                      "mock.texture_detail=0",
                                      "mock.pattern=gbrg",
                                      "mock.ins=ideal",
                                      "odometry.features=300",
                                      "calibration.online=off"};

std::string set_arguments() {
  std::string text;
  for (const std::string& s : kSmall) text += " --set '" + s + "'";
  return text;
}

TEST(StLucia, aDriveReplayedFromTheDataSetsFilesIsTheDriveItself) {
  const TemporaryFolder work;
  const app::Configuration c = app::load_configuration(kRig, kSmall);
  write_st_lucia(c, kSeconds, work / "data");
  app::CalibrationFile calibration;
  calibration.rig = app::nominal_rig(c);
  app::write_calibration(work / "calibration.yaml", calibration);

  const std::string quiet = " --quiet --out '";
  const Outcome run =
      run_vergence("run '" + kRig + "' --fast --duration " + std::to_string(kSeconds) +
                   set_arguments() + quiet + (work / "run").string() + "'");
  ASSERT_EQ(run.code, 0) << run.err;
  const Outcome replay =
      run_vergence("replay '" + (work / "data").string() + "' --format st-lucia --calibration '" +
                   (work / "calibration.yaml").string() +
                   "' --set odometry.features=300 --set calibration.online=off"
                   " --set 'ins.lever_arm_m=[0.9, 0.375, 0.5]' --quiet --out '" +
                   (work / "replay").string() + "'");
  ASSERT_EQ(replay.code, 0) << replay.err;

  EXPECT_EQ(read_file(work / "run" / "trajectory.tum"),
            read_file(work / "replay" / "trajectory.tum"));
  const auto summary = nlohmann::json::parse(read_file(work / "replay" / "summary.json"));
  EXPECT_EQ(summary["frames"]["posed"], 241);
  EXPECT_EQ(summary["frames"]["skipped"], 0);

  // The reference of both: each in the axes of its first place. The INS's readings are 8 ms apart;
  // a log's digits hold micrometres.
  const app::Trajectory ours = app::read_tum(work / "replay" / "reference.tum"),
                        live = app::read_tum(work / "run" / "reference.tum");
  ASSERT_GT(live.size(), 200U);
  std::size_t compared = 0;
  for (const StampedPose& pose : live)
    for (const StampedPose& other : ours) {
      if (other.stamp != pose.stamp) continue;
      EXPECT_LT((other.T_world_body.t - pose.T_world_body.t).norm(), 1e-3);
      EXPECT_LT(log_so3(other.T_world_body.R.transpose() * pose.T_world_body.R).norm(), 1e-4);
      ++compared;
    }
  EXPECT_EQ(compared, live.size());
}

}  // namespace
}  // namespace vergence::test
