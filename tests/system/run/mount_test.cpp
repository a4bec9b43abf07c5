#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include <nlohmann/json.hpp>

#include "app/recorder/ins_file.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::Outcome;
using test::run_vergence;

TEST(MountOfADrive, theRecordedReadingsGiveTheMocksMountWithinThreeSigmas) {
  // A kilometre with left and right turns, a quarter of the pixels; the INS has the errors of an
  // MTi-G.
  const test::TemporaryFolder folder;
  const std::string session = (folder / "s").string();
  const Outcome drive =
      run_vergence("run '" + std::string(VERGENCE_SOURCE_DIR) +
                   "/app/config/mock.yaml' --fast --quiet --out '" + session +
                   "' --set mock.drive=figure-eight --set cameras.0.size=[320,240] --set "
                   "cameras.1.size=[320,240]"
                   " --set mock.texture_detail=0 --set ins.lever_arm_m=[0.9,0.375,0.5]"
                   " --set ins.boresight_deg=[1,-2,3]");
  ASSERT_EQ(drive.code, 0) << drive.err;
  const auto readings = app::read_ins_file(session + "/ins.csv");
  const double seconds =
      (readings.back().sample.stamp - readings.front().sample.stamp).to_seconds();
  EXPECT_GT(seconds, 100);
  EXPECT_NEAR(static_cast<double>(readings.size()), seconds * 120, 2);
  for (std::size_t i = 1; i < readings.size(); ++i)
    ASSERT_EQ(readings[i].sample.number, readings[i - 1].sample.number + 1);

  const Outcome found = run_vergence("evaluate '" + session + "' --estimate-mount --json");
  ASSERT_EQ(found.code, 0) << found.err;
  const auto mount = nlohmann::json::parse(found.out).at("mount");
  ASSERT_EQ(mount["status"], "ok");
  const auto agrees = [&](const nlohmann::json& value, double truth, double widest,
                          const char* what) {
    const double sigma = value["sigma"];
    ASSERT_TRUE(value["value"].is_number()) << what << " should show; sigma " << sigma;
    EXPECT_NEAR(value["value"].get<double>(), truth, 3 * sigma) << what;
    EXPECT_LT(sigma, widest) << what;
  };
  // Yaw 3, pitch −2, roll 1 degrees one after the other are this rotation vector.
  agrees(mount["rotation_deg"]["x"], 1.052, 2, "roll");
  agrees(mount["rotation_deg"]["y"], -1.973, 2, "pitch");
  agrees(mount["rotation_deg"]["z"], 3.017, 2, "yaw");
  agrees(mount["lever_arm_m"]["x"], 0.9, 0.2, "forward");
  agrees(mount["lever_arm_m"]["y"], 0.375, 0.2, "left");
  if (mount["lever_arm_m"]["z"]["value"].is_number())
    agrees(mount["lever_arm_m"]["z"], 0.5, 0.5, "up");
  agrees(mount["clock_offset_s"], 0, 0.005, "clock");
}

}  // namespace
}  // namespace vergence
