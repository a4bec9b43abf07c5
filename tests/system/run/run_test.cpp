#include <chrono>
#include <cmath>
#include <utility>

#include "app/datasets/trajectory_files.hpp"
#include "core/memory/allocation_guard.hpp"
#include "tests/support/refusal.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::events;
using test::kSmall;
using test::Outcome;
using test::read_file;
using test::run_vergence;
using test::summary_of;
using test::TemporaryFolder;

const std::string kMock = std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml";
Outcome drive(const std::filesystem::path& session, const std::string& more) {
  return run_vergence("run '" + kMock + "' --fast --out '" + session.string() + "' " + more);
}

TEST(Run, everyFrameIsPosedNearTruthWithoutAllocations) {
  const TemporaryFolder folder;
  const auto session = folder / "s";
  const Outcome o = drive(session, "--duration 25");
  ASSERT_EQ(o.code, 0) << o.err;
  const auto summary = summary_of(session);
  EXPECT_EQ(summary["frames"]["read"], 501);
  EXPECT_EQ(summary["frames"]["posed"], 501);
  EXPECT_EQ(summary["runtime_allocations"], 0);
  const auto threads = summary["memory"]["allocations_by_thread"];
  for (const char* name :
       {"vergence-estim", "vergence-front", "vergence-calib", "vergence-sync", "vergence-record"})
    EXPECT_EQ(threads.value(name, AllocationGuard::available() ? -1 : 0), 0) << name;
  EXPECT_EQ(summary["devices"]["sets_complete"], 501);
  EXPECT_EQ(summary["devices"]["sets_incomplete"], 0);
  EXPECT_EQ(summary["comparison"]["without_ins"], 0);
  EXPECT_EQ(summary["comparison"]["alignments"], 1);
  // The kilometre's aim is 0.4 % over 100 to 800 m; here only the shortest of those lengths exist,
  // with less to average over.
  EXPECT_LT(summary["truth"]["segment_error_percent"].get<double>(), 0.8);
  EXPECT_LT(summary["truth"]["rotation_error_deg_per_m"].get<double>(), 0.004);
  EXPECT_NEAR(summary["truth"]["path_ratio"].get<double>(), 1, 0.01);
  // The INS wanders by metres: against it the path looks far worse, and the summary does not mix
  // the two up.
  EXPECT_GT(summary["metrics"]["ate_m"].get<double>(), summary["truth"]["ate_m"].get<double>());
  for (const double e : summary["truth"]["calibration_error"])
    EXPECT_EQ(e, 0) << "the estimator was given the true rig";
  for (const char* name : {"trajectory.tum", "reference.tum", "truth.tum", "poses.csv",
                           "events.jsonl", "calibration.yaml", "report.html"})
    EXPECT_GT(std::filesystem::file_size(session / name), 0U) << name;
}

TEST(Run, everySuppliedSimulatedConfigurationRuns) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(VERGENCE_SOURCE_DIR) + "/app/config")) {
    if (entry.path().extension() != ".yaml") continue;
    // Other tests of tests/system run real cameras on their stacks.
    if (read_file(entry.path()).find("driver: mock") == std::string::npos) continue;
    ++files;
    const TemporaryFolder folder;
    const Outcome o = run_vergence("run '" + entry.path().string() +
                                   "' --fast --duration 2 --out '" + (folder / "s").string() + "'");
    EXPECT_EQ(o.code, 0) << entry.path() << ": " << o.err;
    EXPECT_EQ(summary_of(folder / "s")["runtime_allocations"], 0) << entry.path();
  }
  EXPECT_GE(files, 1);
}

TEST(Run, realTimeFramesArePosedOrCounted) {
  const TemporaryFolder folder;
  const auto session = folder / "s";
  const auto before = std::chrono::system_clock::now().time_since_epoch();
  const Outcome o =
      run_vergence("run '" + kMock + "' --duration 4 --out '" + session.string() + "'" + kSmall);
  // 1: too few frames are left on a loaded machine to confirm the calibration by.
  ASSERT_TRUE(o.code == 0 || o.code == 1) << o.code << ": " << o.err;
  const auto summary = summary_of(session);
  const auto& devices = summary["devices"];
  EXPECT_GT(summary["frames"]["posed"].get<int>(), 0);
  const int read = summary["frames"]["read"], overtaken = devices["sets_superseded"];
  EXPECT_EQ(read + overtaken,
            devices["sets_complete"].get<int>() + devices["sets_incomplete"].get<int>());
  // The number of dropped frames depends on the machine; all must be counted.
  EXPECT_EQ(devices["camera0_delivered"].get<int>() + devices["camera0_lost"].get<int>() +
                devices["camera0_underruns"].get<int>(),
            81);
  // The header is not counted.
  EXPECT_EQ(test::lines_of(session / "poses.csv") - 1, read - summary["drops"]["lines"].get<int>());
  EXPECT_EQ(summary["runtime_allocations"], 0);
  const auto lines = test::read_lines(session / "events.jsonl");
  EXPECT_FALSE(lines.empty());
  for (const std::string& line : lines)
    EXPECT_GE(nlohmann::json::parse(line)["stamp_ns"].get<std::int64_t>(),
              std::chrono::nanoseconds(before).count())
        << line;
}

TEST(Run, filesAreTheSameForAnyThreadCount) {
  const TemporaryFolder folder;
  ASSERT_EQ(drive(folder / "a", "--duration 6 --threads 2 --quiet" + kSmall).code, 0);
  ASSERT_EQ(drive(folder / "b", "--duration 6 --threads 1 --quiet" + kSmall).code, 0);
  for (const char* name :
       {"trajectory.tum", "reference.tum", "truth.tum", "events.jsonl", "ins.csv"})
    EXPECT_EQ(read_file(folder / "a" / name), read_file(folder / "b" / name)) << name;
}

TEST(Run, idealInsReferenceIsTruthWithinAMillimetre) {
  const TemporaryFolder folder;
  const auto session = folder / "s";
  const Outcome o = drive(session, "--duration 20 --set mock.ins=ideal --quiet" + kSmall);
  ASSERT_EQ(o.code, 0) << o.err;
  // The whole chain but the odometry: device clocks, tangent plane, interpolation, lever arm. `enu`
  // of the reference begins at the first fix; its axes differ from the world's by the way there
  // over the earth's radius.
  const app::Trajectory reference = app::read_tum(session / "reference.tum"),
                        truth = app::read_tum(session / "truth.tum");
  ASSERT_GT(reference.size(), 390U);
  ASSERT_LE(reference.size(), truth.size());
  double worst_m = 0, worst_rad = 0;
  const Transform& T0 = truth[100].T_world_body;
  const Transform& R0 = reference[100].T_world_body;
  // The clocks are synchronised after five seconds.
  for (std::size_t i = 100; i < reference.size(); ++i) {
    ASSERT_LT(std::abs((reference[i].stamp - truth[i].stamp).to_seconds()), 1e-4);
    const Transform step = T0.inverse() * truth[i].T_world_body,
                    ours = R0.inverse() * reference[i].T_world_body;
    worst_m = std::max(worst_m, (step.t - ours.t).norm());
    worst_rad = std::max(worst_rad, log_so3(step.R.transpose() * ours.R).norm());
  }
  // A stamp that is off by the clocks' 20 µs is 0.24 mm at 12 m/s, one of the INS's as much;
  // straight lines between readings add 0.03 mm.
  EXPECT_LT(worst_m, 1e-3);
  EXPECT_LT(worst_rad, 0.001 * 3.14159265 / 180 * 2)
      << "twice a thousandth of a degree: the chosen start errs, too";
}

TEST(Run, autoExposureKeepsPosesAtNight) {
  const TemporaryFolder folder;
  const std::string night =
      "--duration 14 --quiet --set exposure.mode=auto --fault 'night@5 factor=0.05 duration_s=6'" +
      kSmall;
  ASSERT_EQ(drive(folder / "a", night + " --threads 2").code, 0);
  ASSERT_EQ(drive(folder / "b", night + " --threads 1").code, 0);
  EXPECT_EQ(read_file(folder / "a" / "trajectory.tum"), read_file(folder / "b" / "trajectory.tum"));
  const auto summary = summary_of(folder / "a");
  const auto& devices = summary["devices"];
  // A twentieth of the light is 4.3 stops: at a stop a change, six images apart, some of the first
  // twenty have too little of it.
  EXPECT_GE(summary["frames"]["posed"].get<int>(), 281 - 20);
  EXPECT_GT(devices["exposure_changes"].get<int>(), 4);
  EXPECT_EQ(devices["exposure_refused"].get<int>() + devices["exposure_unequal"].get<int>() +
                devices["exposure_again"].get<int>(),
            0);
  EXPECT_LE(devices["exposure_last_us"].get<int>(), 8000);
  EXPECT_EQ(devices["gain_last_millidb"], 0) << "by day no gain is left";
  EXPECT_EQ(summary["runtime_allocations"], 0);
  // Clocks are mapped by the ends of exposures: their changes do not shift the stamps.
  EXPECT_NEAR(summary["truth"]["path_ratio"].get<double>(), 1, 0.02);
  const Outcome o = drive(
      folder / "c", "--duration 2 --quiet --set exposure.mode=auto --set exposure.max_us=60000");
  EXPECT_EQ(o.code, 2);
  EXPECT_TRUE(
      test::mentions(o.err,
                     "exposure.max_us is 60000, longer than the 50000 µs between two pulses "
                     "(trigger.rate 20)"));
}

TEST(Run, fullDiskLeavesNoTruncatedFileAndExitsFour) {
  const TemporaryFolder folder;
  const auto session = folder / "s";
  // No file can grow beyond 2 kB: as a full disk, but for the errno.
  const Outcome o = run_vergence("run '" + std::string(VERGENCE_SOURCE_DIR) +
                                     "/app/config/mock.yaml' --fast --quiet --duration 3 --out '" +
                                     session.string() + "'" + kSmall,
                                 "ulimit -f 4;");
  EXPECT_EQ(o.code, 4) << o.err;
  for (const char* name : {"summary.json", "summary.json.new", "report.html", "report.html.new"})
    EXPECT_FALSE(std::filesystem::exists(session / name)) << name;
  EXPECT_TRUE(
      test::mentions(o.err,
                     "summary.json: cannot be written (File too large); check the directory's "
                     "permissions and the free space"));
  EXPECT_TRUE(test::mentions(o.err, "poses.csv"));
  const std::string poses = read_file(session / "poses.csv");
  EXPECT_LE(poses.size(), 2048U);
}

TEST(Run, insFaultIsReportedAndPosesContinue) {
  struct Case {
    const char* fault;
    const char* event;
    int code;
  };
  for (const Case& c : {Case{"ins_gone@0 duration_s=4", "ins_timeout", 0},
                        Case{"ins_gone@5 duration_s=0", "ins_timeout", 0},
                        Case{"ins_gone@0 duration_s=0", "ins_timeout", 1},
                        Case{"no_fix@0 duration_s=0", "ins_no_fix", 1}}) {
    SCOPED_TRACE(c.fault);
    const TemporaryFolder folder;
    const auto session = folder / "s";
    const Outcome o =
        drive(session, std::string("--duration 9 --fault '") + c.fault + "'" + kSmall);
    EXPECT_EQ(o.code, c.code) << o.err;
    EXPECT_GE(events(session, c.event).size(), 1U) << read_file(session / "events.jsonl");
    EXPECT_TRUE(test::mentions(o.err, "INS"));
    const auto summary = summary_of(session);
    EXPECT_EQ(summary["frames"]["posed"], 181);
    EXPECT_EQ(summary["runtime_allocations"], 0);
  }
}

TEST(Run, impossibleSettingIsNamedAndExitsTwo) {
  for (const auto& [arguments, named] :
       {std::pair{"--set trigger.rate=0", "trigger.rate is 0"},
        std::pair{"--set ins.rate=0", "ins.rate is 0"},
        std::pair{"--set cameras.1.size=[800,600]", "set the same size for all cameras"},
        std::pair{"--set cameras.0.exposure_us=60000",
                  "longer than the 50000 µs between two pulses"},
        std::pair{"--set cameras.0.driver=gige", "--fast needs simulated cameras"},
        std::pair{"--set cameras.1.driver=", "one camera is configured"},
        std::pair{"--set sync.mode=bord", "did you mean \"board\"?"},
        std::pair{"--set mock.drive=lop", "did you mean \"loop\"?"},
        std::pair{"--set rig.nominal.focal_px=3", "rig.nominal"},
        std::pair{"--fault knok@3", "unknown fault \"knok\""},
        std::pair{"--fault 'cover@1 camera=3'", "there is no camera 3"},
        std::pair{"--set 'faults.0=drift@x'", "faults.0: the time of drift is \"x\""},
        std::pair{"--duration=-1", "--duration: \"-1\" must be"}}) {
    const TemporaryFolder folder;
    const Outcome o = drive(folder / "s", arguments);
    EXPECT_EQ(o.code, 2) << o.err;
    EXPECT_TRUE(test::mentions(o.err, named));
    EXPECT_FALSE(std::filesystem::exists(folder / "s")) << arguments;
  }
}

}  // namespace
}  // namespace vergence
