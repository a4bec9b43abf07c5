#include "tests/support/child_program.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/ros_messages.hpp"
#include "tests/system/replay/replayed_folder.hpp"

namespace vergence::test {
namespace {

TEST_F(ReplayedFolder, everyFrameIsPosedAndSessionIsComplete) {
  const Outcome o = replay();
  ASSERT_EQ(o.code, 0) << o.err;
  for (const char* file : {"trajectory.tum", "poses.csv", "calibration.yaml", "calibrations.csv",
                           "events.jsonl", "summary.json", "report.html"})
    EXPECT_TRUE(fs::exists(session() / file)) << file;
  const auto s = summary();
  EXPECT_EQ(s["frames"]["posed"], kFrames);
  EXPECT_EQ(s["frames"]["skipped"], 0);
  EXPECT_EQ(s["runtime_allocations"], 0);
  // A plain folder has no ground truth.
  EXPECT_TRUE(s["metrics"].is_null());
}

TEST_F(ReplayedFolder, shortSequenceReportsUnverifiedCalibration) {
  // A calibration that is given is judged with 20 frames for the first time.
  const Outcome o = run_vergence("replay '" + data().string() + "' --format folder --frames 18 " +
                                 "--out '" + session().string() + "'");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(summary()["calibration"]["verified"], false);
  EXPECT_TRUE(summary()["calibration"]["verified_frame"].is_null());
  EXPECT_TRUE(test::mentions(o.err, "the calibration was never verified"));
  EXPECT_TRUE(
      test::mentions(read_file(session() / "poses.csv"), "degraded,unverified_calibration"));
  EXPECT_TRUE(test::mentions(read_file(session() / "report.html"), "not verified"));
}

TEST_F(ReplayedFolder, fromScratchNeedsOnlyIntrinsicsAndLength) {
  std::string text = read_file(data() / "calibration.yaml");
  const auto at = text.find("    T_camera_left: [");
  ASSERT_NE(at, std::string::npos);
  text.erase(at, text.find('\n', at) + 1 - at);
  write("calibration.yaml", text);
  expect_refused("--from-scratch");
  fs::remove_all(session());
  const Outcome o = replay("--from-scratch");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(summary()["frames"]["posed"], kFrames);
  EXPECT_TRUE(summary()["calibration"]["initial"].is_null());
  fs::remove_all(session());
  text.insert(at, "    T_left_camera: [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0]\n");
  write("calibration.yaml", text);
  expect_refused("is the inverse of T_camera_left");
}

/// → whether a terminal shows it before it closes.
bool shows(int terminal, const std::string& words) {
  std::string shown;
  std::array<char, 256> piece;
  while (shown.find(words) == std::string::npos) {
    const auto n = ::read(terminal, piece.data(), piece.size());
    if (n <= 0) return false;
    shown.append(piece.data(), static_cast<std::size_t>(n));
  }
  return true;
}

TEST_F(ReplayedFolder, signalDuringCalibrationStopsTheReplay) {
  for (const int number : {SIGINT, SIGTERM}) {
    ChildProgram program(
        {"replay", data(), "--format", "folder", "--calibrate-first", "--out", session()},
        {.terminal = true});
    ASSERT_TRUE(shows(program.terminal(), "calibrating from the sequence"));
    program.signal(number);
    EXPECT_EQ(program.wait(), 128 + number);
  }
}

TEST_F(ReplayedFolder, swappedFoldersExitOneAndAreReported) {
  fs::rename(data() / "left", data() / "other");
  fs::rename(data() / "right", data() / "left");
  fs::rename(data() / "other", data() / "right");
  const Outcome o = replay();
  EXPECT_EQ(o.code, 1) << o.err;
  EXPECT_TRUE(test::mentions(o.err, "do not use these poses: ", "of 24 frames)"));
  EXPECT_TRUE(test::mentions(read_file(session() / "report.html"), "Do not use"));
  EXPECT_FALSE(test::contains(read_file(session() / "report.html"), "is missing"))
      << "nothing is, but what is so by design";
}

TEST_F(ReplayedFolder, referenceNextToTheImagesIsCompared) {
  ASSERT_EQ(replay().code, 0);
  EXPECT_FALSE(fs::exists(session() / "reference.tum")) << "there was none";
  fs::copy(session() / "trajectory.tum", data() / "truth.tum");
  fs::remove_all(session());
  ASSERT_EQ(replay().code, 0);
  EXPECT_LT(summary()["metrics"]["ate_m"].get<double>(), 1e-6);
  EXPECT_TRUE(fs::exists(session() / "reference.tum"));
}

TEST_F(ReplayedFolder, incompleteFocalLengthOptionsAreRefused) {
  for (const char* bad : {"--focal 500", "--focal 5 --baseline 0.5",
                          "--focal 500 --baseline 0.5 --calibration c.yaml"}) {
    const Outcome o = replay(bad);
    EXPECT_EQ(o.code, 2) << bad << o.err;
    EXPECT_TRUE(test::mentions(o.err, "--")) << bad;
    EXPECT_FALSE(fs::exists(session())) << bad;
  }
}

TEST_F(ReplayedFolder, suppliedBaselineScalesThePath) {
  ASSERT_EQ(replay().code, 0);
  const double way = summary()["path_m"], length = summary()["calibration"]["baseline_m"];
  fs::remove_all(session());
  const Outcome o = replay(fmt::format("--baseline {}", 2 * length));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_NEAR(summary()["path_m"].get<double>(), 2 * way, 0.02 * way);
  EXPECT_NEAR(summary()["calibration"]["baseline_m"].get<double>(), 2 * length, 1e-9);
  EXPECT_EQ(run_vergence("replay x --format folder --out y --baseline 0").code, 2);
}

TEST_F(ReplayedFolder, thousandMissingImagesAreListedOthersCounted) {
  constexpr std::size_t kMissing = 1300;
  std::string times;
  for (std::size_t i = 0; i < kFrames + kMissing; ++i)
    times += fmt::format("{},{:03d}.png\n", 1'577'836'800'000'000'000 + 50'000'000 * i, i);
  std::ofstream(data() / "times.txt") << times;
  const Outcome o = replay();
  ASSERT_TRUE(fs::exists(session() / "events.jsonl")) << o.err;
  std::size_t listed = 0;
  std::string last;
  for (const std::string& line : read_lines(session() / "events.jsonl"))
    if (contains(line, "image_missing")) ++listed, last = line;
  EXPECT_EQ(listed, 1001U);
  EXPECT_TRUE(test::mentions(last, "1000 frames could not be read"));
  EXPECT_EQ(summary()["frames"]["skipped"], kMissing);
}

TEST_F(ReplayedFolder, bagGivesThePosesOfTheSameImages) {
  ASSERT_EQ(replay().code, 0);
  const std::string poses = read_file(session() / "trajectory.tum");
  for (const BagKind& kind : {BagKind{"mcap", "zstd"}, BagKind{"rosbag", "bz2"}}) {
    const auto bag = kind.writer();
    bag->channel(1, "/left/image_raw/compressed", "sensor_msgs/CompressedImage");
    bag->channel(2, "/right/image_raw/compressed", "sensor_msgs/CompressedImage");
    std::ifstream times(data() / "times.txt");
    std::size_t pair = 0;
    for (std::int64_t ns = 0; times >> ns; ++pair) {
      for (int k = 0; k < 2; ++k)
        bag->message(
            static_cast<std::uint16_t>(k + 1), ns,
            compressed_message(kind.wire(), ns, "png", read_file(data() / image_name(k, pair))));
      // The bag is never finished, as after the kill of a recorder.
      bag->close_chunk();
    }
    ASSERT_EQ(pair, kFrames);
    const std::string name = "drive" + kind.ending();
    const fs::path file = work_.write(name, bag->bytes());
    const fs::path other = work_ / ("of_" + name);
    const Outcome o =
        run_vergence("replay '" + file.string() + "' --out '" + other.string() +
                     "' --calibration '" + (data() / "calibration.yaml").string() + "'");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_TRUE(test::mentions(o.err, name + " is incomplete"));
    EXPECT_EQ(read_file(other / "trajectory.tum"), poses);
  }
}

}  // namespace
}  // namespace vergence::test
