#include <nlohmann/json.hpp>

#include "app/runtime/nearest.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::app {
namespace {

using test::contains;

using test::Outcome;
using test::run_vergence;

/// Checks a refusal: exit 2, nothing on stdout, one line on stderr.
testing::AssertionResult refused_in_one_message(const Outcome& outcome) {
  const auto lines = std::count(outcome.err.begin(), outcome.err.end(), '\n');
  if (outcome.code == 2 && outcome.out.empty() && lines == 1 && outcome.err.size() > 20)
    return testing::AssertionSuccess();
  return testing::AssertionFailure() << "exit code " << outcome.code << ", stdout \"" << outcome.out
                                     << "\", stderr \"" << outcome.err << '"';
}

TEST(Program, renamedWordsAreRefusedWithTheirNewName) {
  using Kind = Renamed::Kind;
  const test::TemporaryFolder folder;
  folder.write("rig.yaml", "threads: 1\n");
  const std::string out = " --out '" + (folder / "out").string() + "'",
                    run = "run '" + (folder / "rig.yaml").string() + "'" + out + " --set ";
  for (const Renamed& row : renamed()) {
    const std::string name(row.name);
    const std::string words = row.kind == Kind::key ? run + name + "=1"
                              : row.kind == Kind::value
                                  ? run + std::string(name).replace(name.find(' '), 1, "=")
                                  : name + " x" + out;
    const Outcome outcome = run_vergence(words);
    EXPECT_TRUE(refused_in_one_message(outcome)) << name;
    EXPECT_TRUE(contains(outcome.err, std::string(row.now))) << name << ": " << outcome.err;
  }
}

TEST(Program, unknownCommandNamesNearest) {
  const Outcome outcome = run_vergence("evalute a b");
  EXPECT_TRUE(refused_in_one_message(outcome));
  EXPECT_TRUE(
      test::mentions(outcome.err, "unknown command \"evalute\"; did you mean \"evaluate\"?"));
  EXPECT_TRUE(refused_in_one_message(run_vergence("''")));
}

TEST(Program, controlCodesOfArgumentsAreRemoved) {
  const Outcome outcome = run_vergence("\"$(printf 'a\\033[2Jb\\nc')\"");
  EXPECT_TRUE(refused_in_one_message(outcome));
  EXPECT_FALSE(contains(outcome.err, "\033"));
}

TEST(Program, smallStackIsReportedBeforeOverflow) {
  const test::Outcome o = test::run_vergence("--version", "ulimit -S -s 64;");
  EXPECT_EQ(o.code, 2);
  EXPECT_TRUE(
      test::mentions(o.err, "the stack is limited to 64 kB, and 1024 are needed: raise the limit"));
}

TEST(Program, unwritableStandardOutputIsAnError) {
  constexpr const char* kCommand = "'" VERGENCE_PROGRAM "' --help >/dev/full 2>/dev/null";
  EXPECT_EQ(WEXITSTATUS(std::system(kCommand)), 2);
}

nlohmann::json simulate(const std::string& options) {
  const test::TemporaryFolder folder;
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
}  // namespace vergence::app
