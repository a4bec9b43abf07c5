#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

nlohmann::json simulate(const std::string& options) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "simulation.json";
  const Outcome outcome =
      run_vergence("simulate --quiet --json '" + file.string() + "' " + options);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  std::ifstream in(file);
  return nlohmann::json::parse(in);
}

TEST(Simulate, jsonHasOneObjectPerNoiseLevel) {
  const nlohmann::json levels = simulate("--points 60 --runs 20 --noise 0,0.1,0.2");
  ASSERT_EQ(levels.size(), 3U);
  for (const nlohmann::json& level : levels) {
    for (const char* key :
         {"pixel_noise", "runs", "failed", "mean_reprojection_px", "mean_pose_error_m",
          "mean_rotation_error_rad", "mean_translation_error_m", "median_ms", "mean_steps"})
      EXPECT_TRUE(level.contains(key)) << key;
    EXPECT_EQ(level["runs"], 20);
    EXPECT_EQ(level["failed"], 0);
  }
  EXPECT_LT(levels[0]["mean_reprojection_px"], 1e-10);
  // Every level has the same geometry: errors grow with the noise, up to the curvature of the
  // problem.
  for (const char* key : {"mean_reprojection_px", "mean_pose_error_m", "mean_rotation_error_rad",
                          "mean_translation_error_m"})
    EXPECT_NEAR(levels[2][key].get<double>() / levels[1][key].get<double>(), 2.0, 0.05) << key;
  // This is the mean length of a 2-D Gaussian, less the degrees of freedom used.
  EXPECT_NEAR(levels[1]["mean_reprojection_px"].get<double>(), 0.1 * 1.2533, 0.01);
}

TEST(Simulate, refusesImpossibleOptionsInOneLine) {
  for (const char* options : {"--points 0", "--runs 0", "--noise -1", "--noise x", "--cameras 9",
                              "--radius 1000", "--json /nowhere/file.json", "--shape cube"}) {
    const Outcome outcome = run_vergence(std::string("simulate --quiet ") + options);
    EXPECT_EQ(outcome.code, 2) << options;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

}  // namespace
}  // namespace vergence::test
