

#include "app/datasets/trajectory_files.hpp"
#include "tests/support/gige_pair.hpp"
#include "tests/support/simulators/board_simulator.hpp"
#include "tests/support/thread_allocations.hpp"
#include "tests/support/xsens_terminal.hpp"
#include "tests/system/gige/socket_buffer.hpp"
#include "tests/system/odometry/stereo_drive.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::Outcome;
using test::run_vergence;

constexpr int kWidth = 640, kHeight = 480, kPairs = 40;
constexpr double kRate = 10;

const std::string kExample = std::string(VERGENCE_SOURCE_DIR) + "/app/config/gige.yaml";

/// Four seconds of the mock's drive, from its standing start on; rows of 640 px have no padding.
test::StereoDrive rendered() {
  return test::render({.rig = test::nominal_rig(),
                       .drive = {.kind = mock::DriveKind::brief, .speed = 8, .stop_s = 1},
                       .from_s = 0,
                       .rate = kRate},
                      kPairs);
}

/// The two cameras of the example, which show the drive.
test::GigePair cameras_on(const test::StereoDrive& drive) {
  return {"RUN", 0, kWidth, kHeight, [&drive](std::size_t k, std::uint64_t n) {
            return drive.pairs[std::min<std::size_t>(n, drive.size() - 1)][k].bytes.data();
          }};
}

const std::string kSettings =
    " --set trigger.rate=10 --set rig.nominal.k1=-0.08 --set rig.nominal.k2=0.02 --set "
    "rig.nominal.baseline_m=0.75 --set rig.state_dir=none "
    "--set 'cameras.1.T_camera_left=[1,0,0,-0.75,0,1,0,0,0,0,1,0]'";

double path_length(const std::vector<Vec3>& places) {
  double sum = 0;
  for (std::size_t i = 1; i < places.size(); ++i) sum += (places[i] - places[i - 1]).norm();
  return sum;
}

TEST(GigeRun, everyPairOverGigeVisionIsPosed) {
  if (const std::string why = test::socket_buffer_obstacle(); !why.empty()) GTEST_SKIP() << why;
  const test::StereoDrive drive = rendered();
  const test::GigePair cameras = cameras_on(drive);
  std::jthread pulses = cameras.pulses(kRate, kPairs);
  const test::TemporaryFolder folder;
  const auto session = folder / "s";
  const Outcome o =
      run_vergence("run '" + kExample + "' --duration " + std::to_string(kPairs / kRate + 3) +
                   " --out '" + session.string() + "'" + kSettings + cameras.settings());
  pulses.join();
  ASSERT_EQ(o.code, 0) << o.err;
  const auto summary = test::summary_of(session);
  const auto& devices = summary["devices"];
  EXPECT_EQ(summary["frames"]["read"], kPairs);
  EXPECT_EQ(summary["frames"]["posed"], kPairs);
  EXPECT_EQ(summary["runtime_allocations"], 0);
  // Aravis takes two blocks for every image that begins (a breakpoint on ThreadAllocations::count).
  test::expect_no_heap_but_of({"vergence-gige", std::uint64_t{2} * 2 * kPairs}, summary);
  EXPECT_EQ(devices["sets_complete"], kPairs);
  EXPECT_EQ(devices["sets_incomplete"], 0);
  EXPECT_EQ(devices["sets_ambiguous"], 0);
  for (const char* camera : {"camera0_", "camera1_"}) {
    EXPECT_EQ(devices[camera + std::string("delivered")], kPairs);
    EXPECT_EQ(devices[camera + std::string("lost")], 0);
    EXPECT_EQ(devices[camera + std::string("underruns")], 0);
  }
  const auto poses = app::read_tum(session / "trajectory.tum");
  ASSERT_EQ(poses.size(), static_cast<std::size_t>(kPairs));
  EXPECT_FALSE(summary.contains("truth") && !summary["truth"].is_null() &&
               summary["truth"].contains("ate_m"))
      << "there is no ground truth";
  std::vector<Vec3> travelled, truth;
  for (const StampedPose& p : poses) travelled.push_back(p.T_world_body.t);
  for (const Transform& T_enu_left : drive.truth) truth.push_back(T_enu_left.t);
  EXPECT_GT(path_length(truth), 5);
  EXPECT_NEAR(path_length(travelled) / path_length(truth), 1, 0.03);
  // By the host's clock the pulses came 100 ms apart; the stamps are the cameras', mapped.
  for (std::size_t i = 1; i < poses.size(); ++i) EXPECT_GT(poses[i].stamp, poses[i - 1].stamp);
}

/// A trigger board on a terminal whose pulses the cameras expose at.
std::unique_ptr<test::BoardSimulator> board_of(const test::GigePair& cameras) {
  test::BoardSimulatorOptions o{.power_on = monotonic_now()};
  return std::make_unique<test::BoardSimulator>(
      [&cameras, n = std::uint64_t{0}](const test::SimulatedPulse& pulse) mutable {
        cameras.pulse(n++, pulse.edge);
        return test::SimulatedExposures{};
      },
      o);
}

/// With an INS and a board behind terminals, twice as long as the film lasts.
Outcome record_drive(const test::StereoDrive& drive, const std::filesystem::path& session) {
  const test::GigePair cameras = cameras_on(drive);
  const test::DeviceOnTerminal ins(test::resting_xsens()), board(board_of(cameras));
  return run_vergence("run '" + kExample + "' --duration " + std::to_string(2 * kPairs / kRate) +
                      " --out '" + session.string() + "'" + kSettings + cameras.settings() +
                      " --record images,ins,pulses --set ins.driver=xsens --set ins.rate=100 "
                      "--set ins.baud=115200 --set ins.port=" +
                      ins.port() +
                      " --set trigger.driver=board --set sync.mode=board --set "
                      "trigger.dither_us=4000 --set trigger.port=" +
                      board.port());
}

// In real time, with INS and trigger board on serial lines.
TEST(GigeRun, recordedGigeRunReplaysBitForBit) {
  if (const std::string why = test::socket_buffer_obstacle(); !why.empty()) GTEST_SKIP() << why;
  const test::StereoDrive drive = rendered();
  const test::TemporaryFolder folder;
  const Outcome o = record_drive(drive, folder / "s");
  ASSERT_LE(o.code, 1) << o.err;
  const Outcome again = run_vergence("replay '" + (folder / "s").string() + "' --out '" +
                                     (folder / "again").string() + "'");
  ASSERT_LE(again.code, 1) << again.err;
  EXPECT_EQ(test::read_file(folder / "s" / "trajectory.tum"),
            test::read_file(folder / "again" / "trajectory.tum"));
  EXPECT_GT(test::summary_of(folder / "s")["frames"]["read"].get<int>(), 4);
}

}  // namespace
}  // namespace vergence
