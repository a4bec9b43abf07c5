#include <cmath>

#include <fmt/format.h>

#include "app/config/calibration_file.hpp"
#include "tests/support/refusal.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

namespace fs = std::filesystem;

/// Short drives with small images in a folder of their own, with a state folder beside the
/// sessions.
class CalibrationCli : public ::testing::Test {
 protected:
  [[nodiscard]] fs::path session(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] fs::path state() const { return folder_ / "state" / "calibration_state.yaml"; }
  [[nodiscard]] std::string arguments(const std::string& name, const std::string& more) const {
    return fmt::format(
        "run '{}/app/config/mock.yaml' --quiet --out '{}' --set rig.state_dir='{}' --set "
        "cameras.0.name=links{} {}",
        VERGENCE_SOURCE_DIR, session(name).string(), (folder_ / "state").string(), kSmall, more);
  }
  [[nodiscard]] Outcome drive(const std::string& name, const std::string& more) const {
    return run_vergence(arguments(name, "--fast " + more));
  }
  [[nodiscard]] nlohmann::json summary(const std::string& name) const {
    return summary_of(session(name));
  }
  [[nodiscard]] std::vector<std::string> lines(const std::string& name,
                                               const std::string& file) const {
    return read_lines(session(name) / file);
  }
  [[nodiscard]] std::vector<std::string> events(const std::string& name,
                                                const std::string& kind) const {
    return test::events(session(name), kind);
  }
  [[nodiscard]] std::size_t frames_with(const std::string& name, const std::string& word) const {
    const auto poses = lines(name, "poses.csv");
    return static_cast<std::size_t>(std::count_if(
        poses.begin(), poses.end(),
        [&](const std::string& l) { return l.find("," + word + ",") != std::string::npos; }));
  }

  TemporaryFolder folder_;
};

/// The rig stands for three seconds, and a calibration needs about two of motion.
constexpr const char* kLongEnough = "--duration 9";

TEST_F(CalibrationCli, fromScratchCalibrationIsInEveryFile) {
  const Outcome o = drive("s", std::string("--from-scratch ") + kLongEnough);
  ASSERT_EQ(o.code, 0) << o.err;
  const auto rows = lines("s", "calibrations.csv");
  ASSERT_GE(rows.size(), 2U);
  EXPECT_TRUE(test::mentions(rows[1], ",from_scratch,"))
      << "nothing was given: the first row is of the first attempt: ";
  const auto accepted = [](const std::string& row) {
    return row.find(",accepted,from_scratch,") != std::string::npos;
  };
  EXPECT_EQ(std::count_if(rows.begin(), rows.end(), accepted), 1);

  const auto s = summary("s");
  EXPECT_EQ(s["frames"]["posed"], s["frames"]["read"]) << "a pose comes out all the time";
  EXPECT_EQ(s["runtime_allocations"], 0) << "the solver's thread is sealed, too";
  const auto& c = s["calibration"];
  EXPECT_EQ(c["source"], "online");
  EXPECT_TRUE(c["initial"].is_null());
  EXPECT_GE(c["from_scratch"]["frames"].get<int>(), 25);
  EXPECT_GT(c["from_scratch"]["latency_frames"].get<int>(), 25);
  EXPECT_TRUE(c["rating"].is_string());
  EXPECT_GT(c["depth_error_percent"]["50"].get<double>(),
            c["depth_error_percent"]["20"].get<double>());
  for (const auto& again : s["recalibrations"]) EXPECT_EQ(again["reason"], "refinement");
  EXPECT_GT(s["timing_ms"]["while_calibrating"]["frames"].get<int>(), 25);
  ASSERT_EQ(s["truth"]["calibration"].size(), 1U);
  for (const auto& e : s["truth"]["calibration"][0]["rotation_rad"])
    EXPECT_LT(std::abs(e.get<double>()), 0.005) << "a yaw and the lens's centre are hardly two";

  const app::CalibrationFile found = app::read_calibration(session("s") / "calibration.yaml");
  EXPECT_EQ(found.source, "online");
  EXPECT_EQ(found.names[0], "links");
  EXPECT_EQ(found.serials[1], "mock-1");
  EXPECT_GT(found.rig.scale_sigma, 0);
  EXPECT_GT(found.rig.sigma_total[1][4], 0);
  EXPECT_EQ(events("s", "calibration_saved").size(), events("s", "calibration_accepted").size());
  EXPECT_TRUE(
      read_file(state()).starts_with(read_file(session("s") / "calibration.yaml") + "configured:"))
      << "what is kept is what is in use, and what it was found under";
}

TEST_F(CalibrationCli, stateFileIsUsedUnlessTheRigDiffers) {
  ASSERT_EQ(drive("first", std::string("--from-scratch ") + kLongEnough).code, 0);
  const std::string kept = read_file(state());

  const Outcome second = drive("second", "--duration 4");
  ASSERT_EQ(second.code, 0) << second.err;
  EXPECT_TRUE(test::mentions(lines("second", "calibrations.csv").at(1), ",accepted,state_file,"));
  EXPECT_GT(frames_with("second", "unverified_calibration"), 0U)
      << "until the monitor has seen that it still is true";
  EXPECT_EQ(app::read_calibration(session("second") / "calibration.yaml").rig.T_camera_left[1].t,
            app::read_calibration(state()).rig.T_camera_left[1].t);

  const Outcome other = drive("other", "--duration 1 --set cameras.1.serial=another");
  EXPECT_EQ(other.code, 0);
  EXPECT_TRUE(test::mentions(other.err, "another")) << "the reason why it is not used";
  EXPECT_TRUE(test::mentions(lines("other", "calibrations.csv").at(1), ",accepted,given,"));
  EXPECT_EQ(read_file(state()), kept) << "nothing was accepted since";

  EXPECT_EQ(events("other", "calibration").size(), 1U) << "and its session has the message, too";

  const Outcome lenses = drive("lenses", "--duration 1 --set rig.nominal.focal_px=250");
  EXPECT_TRUE(test::mentions(lenses.err, "rig.nominal.focal_px")) << "why it is not used";
}

TEST_F(CalibrationCli, unwritableStateFileIsReportedAndRunContinues) {
  folder_.write("state", "a file where the folder should be");
  const Outcome o = drive("s", std::string("--from-scratch ") + kLongEnough);
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(events("s", "calibration_save_failed").size(),
            events("s", "calibration_accepted").size());
  EXPECT_TRUE(test::mentions(o.err, "the next run will not use"));
}

TEST_F(CalibrationCli, suppliedFilePrecedesStateUnlessSizeDiffers) {
  ASSERT_EQ(drive("first", "--duration 1").code, 0);
  const fs::path mine = session("first") / "calibration.yaml";
  fs::create_directories(state().parent_path());
  fs::copy_file(mine, state());
  const Outcome o = drive("s", fmt::format("--duration 1 --calibration '{}'", mine.string()));
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(
      test::mentions(lines("s", "calibrations.csv").at(1), ",accepted,given,calibration.yaml,"));
  const Outcome refused =
      drive("t", fmt::format("--duration 1 --calibration '{}' --set cameras.0.size=[640,480] --set "
                             "cameras.1.size=[640,480]",
                             mine.string()));
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(test::mentions(refused.err, "cameras.0.size is 640 x 480"));
}

TEST_F(CalibrationCli, sigusr1RequestsRecalibration) {
  // In real time; the signal comes once the first poses are in the file.
  const std::string command = arguments("s", "--duration 5");
  const std::string script = fmt::format(
      "true; '{}' {} & pid=$!; for i in $(seq 300); do [ \"$(wc -l <'{}' 2>/dev/null || echo 0)\" "
      "-gt 3 ] && break; sleep 0.1; done; kill -USR1 $pid; wait $pid",
      VERGENCE_PROGRAM, command, (session("s") / "poses.csv").string());
  const fs::path file = folder_ / "drive.sh";
  folder_.write("drive.sh", script);
  const int status = std::system(("sh '" + file.string() + "' >/dev/null 2>&1 </dev/null").c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_LE(WEXITSTATUS(status), 1) << "no frame need be ok so soon";
  EXPECT_EQ(events("s", "recalibration_requested").size(), 1U);
  EXPECT_GT(frames_with("s", "recalibrating"), 0U);
}

TEST_F(CalibrationCli, doubledBaselineDisagreesWithIns) {
  const Outcome o = drive("s",
                          "--duration 29 --set mock.ins=ideal --set "
                          "mock.calibration_error.length_percent=100 --set rig.state_dir=none");
  ASSERT_EQ(o.code, 0) << o.err;
  ASSERT_EQ(events("s", "scale_disagrees").size(), 1U);
  EXPECT_TRUE(test::mentions(events("s", "scale_disagrees")[0], "longer than the INS's"));
  EXPECT_GT(summary("s")["comparison"]["scale_disagrees"].get<int>(), 0);
  EXPECT_NEAR(summary("s")["truth"]["path_ratio"].get<double>(), 2, 0.05)
      << "the estimator stays as it is: images cannot tell";
}

}  // namespace
}  // namespace vergence::test
