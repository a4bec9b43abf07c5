#include <cstring>

#include "app/datasets/text_file.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "tests/support/recording_reader.hpp"
#include "tests/support/refusal.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::Outcome;
using test::read_file;
using test::run_vergence;
using test::summary_of;
using test::TemporaryFolder;

const std::string kMock = std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml";
const std::string kRecord = " --set record.poses=on --set record.ins=on --set record.images=on";

Outcome drive(const std::filesystem::path& session, const std::string& more) {
  return run_vergence("run '" + kMock + "' --out '" + session.string() + "'" + test::kSmall +
                      kRecord + " " + more);
}

Outcome replay(const std::filesystem::path& data, const std::filesystem::path& session,
               const std::string& more = "") {
  return run_vergence("replay '" + data.string() + "' --out '" + session.string() + "' " + more);
}

Outcome export_to(const std::filesystem::path& data, const std::filesystem::path& session,
                  const std::string& more) {
  return run_vergence("export '" + session.string() + "' --out '" + data.string() + "' " + more);
}

void expect_same_poses(const std::filesystem::path& a, const std::filesystem::path& b) {
  const std::string poses = read_file(a / "trajectory.tum");
  EXPECT_FALSE(poses.empty());
  EXPECT_EQ(poses, read_file(b / "trajectory.tum"));
}

/// One drive with a knock, a camera that is disconnected for a while and a calibration asked for:
/// recorded once for all tests that read it.
class RecordedDrive : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const Outcome o = drive(session(),
                            "--fast --duration 12 --fault \"camera_gone@5 camera=1 duration_s=1\" "
                            "--fault \"recalibrate@3\"");
    ASSERT_LE(o.code, 1) << o.err;
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::filesystem::path session() { return *folder_ / "drive"; }
  static std::filesystem::path out(const std::string& name) { return *folder_ / name; }
  /// The session's recording with `change` made to it, in a folder of its own.
  template <class Change>
  static std::filesystem::path changed(const std::string& name, const Change& change) {
    std::string bytes = test::read_file(session() / "drive.mcap");
    change(&bytes);
    (void)folder_->write(name + "/drive.mcap", bytes);
    (void)folder_->write(name + "/poses.csv", "");
    return *folder_ / name;
  }

 private:
  static inline TemporaryFolder* folder_ = nullptr;
};

TEST_F(RecordedDrive, recordingReplaysBitForBit) {
  const Outcome o = replay(session(), out("again"));
  EXPECT_LE(o.code, 1) << o.err;
  expect_same_poses(session(), out("again"));
  EXPECT_EQ(read_file(session() / "reference.tum"), read_file(out("again") / "reference.tum"));
  EXPECT_TRUE(test::mentions(o.err, "the same input as in the recorded run"));
  EXPECT_EQ(summary_of(out("again"))["runtime_allocations"], 0);
}

TEST_F(RecordedDrive, recordingHasEveryMessageOnceAndIsFinished) {
  const auto file = test::read_mcap(session() / "drive.mcap");
  EXPECT_TRUE(file.scan.finished);
  std::map<std::string, int> count;
  for (const auto& m : file.messages) ++count[m.topic];
  const int frames = summary_of(session())["frames"]["read"];
  EXPECT_EQ(count["/vergence/frame"], frames);
  EXPECT_EQ(count["/left/image_raw"], frames);
  EXPECT_EQ(count["/left/camera_info"], frames);
  // The right camera was disconnected for a second.
  EXPECT_LT(count["/right/image_raw"], frames);
  EXPECT_EQ(count["/ins/fix"], count["/vergence/ins_reading"]);
  EXPECT_EQ(count["/vergence/session"], 1);
  EXPECT_GE(count["/tf_static"], 1);
  EXPECT_EQ(summary_of(session())["devices"]["recording_dropped"], 0);
}

TEST_F(RecordedDrive, damagedImagesAreReportedAndOthersReplay) {
  const auto damaged = changed("damaged", [](std::string* bytes) {
    // In the middle of three images.
    for (std::size_t n = 0, at = 0; n < 30; ++n) {
      at = bytes->find("mono8", at + 1);
      ASSERT_NE(at, std::string::npos);
      if (n % 10 == 0) (*bytes)[at + 40'000] = static_cast<char>((*bytes)[at + 40'000] ^ 4);
    }
  });
  const Outcome o = replay(damaged, out("of-damaged"));
  EXPECT_LE(o.code, 1) << o.err;
  EXPECT_TRUE(test::mentions(o.err, "3 images are damaged"));
  EXPECT_FALSE(test::contains(o.err, "the same input as in the recorded run")) << o.err;
  EXPECT_EQ(summary_of(out("of-damaged"))["frames"]["read"],
            summary_of(session())["frames"]["read"]);
}

TEST_F(RecordedDrive, foreignOrNewerRecordingIsRefused) {
  const auto newer = changed("newer", [](std::string* bytes) {
    const std::string word = "\"version\": 1";
    const auto at = bytes->find(word);
    ASSERT_NE(at, std::string::npos);
    bytes->replace(at, word.size(), "\"version\": 7");
  });
  Outcome o = replay(newer, out("of-newer"));
  EXPECT_EQ(o.code, 2);
  EXPECT_TRUE(test::mentions(o.err, "is a recording of version 7"));
  const auto foreign = changed("foreign", [](std::string* bytes) {
    for (std::size_t at = 0; (at = bytes->find("/vergence/session", at)) != std::string::npos;)
      bytes->replace(at, 17, "/somebody/session");
  });
  o = replay(foreign, out("of-foreign"));
  EXPECT_EQ(o.code, 2);
  EXPECT_TRUE(test::mentions(o.err, "another program"));
  const auto empty = changed("empty", [](std::string* bytes) { bytes->clear(); });
  o = replay(empty, out("of-empty"));
  EXPECT_EQ(o.code, 2) << o.err;
}

TEST_F(RecordedDrive, recordingIsExportedToFolderAndEuroc) {
  const auto to = [&](const std::string& format) {
    return export_to(out(format), session(), "--format " + format);
  };
  const Outcome folder = to("folder");
  EXPECT_EQ(folder.code, 0) << folder.err;
  EXPECT_TRUE(test::mentions(folder.err, "frames without both images were left out"));
  EXPECT_LE(replay(out("folder"), out("of-folder")).code, 1);
  const Outcome euroc = to("euroc");
  EXPECT_EQ(euroc.code, 0) << euroc.err;
  EXPECT_LE(replay(out("euroc"), out("of-euroc")).code, 1);
  // Pixels, stamps and rig agree, except the rig's last digit.
  const auto a = app::read_tum(out("of-folder") / "trajectory.tum");
  const auto b = app::read_tum(out("of-euroc") / "trajectory.tum");
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); i += 10) {
    EXPECT_EQ(a[i].stamp, b[i].stamp);
    EXPECT_LT((a[i].T_world_body.t - b[i].T_world_body.t).norm(), 1e-2);
  }
  const Outcome kitti = to("kitti");
  EXPECT_EQ(kitti.code, 2);
  EXPECT_TRUE(test::mentions(kitti.err, "cannot store distortion"));
  EXPECT_FALSE(std::filesystem::exists(out("kitti")));
}

TEST(Recorded, recordingWithoutCalibrationIsCalibratedFromImages) {
  const TemporaryFolder folder;
  const auto session = folder / "drive";
  EXPECT_LE(drive(session, "--fast --duration 12 --from-scratch").code, 1);
  const Outcome o = replay(session, folder / "again", "--calibrate-first");
  EXPECT_LE(o.code, 1) << o.err;
  const auto summary = summary_of(folder / "again");
  EXPECT_TRUE(summary["calibration"]["verified"]);
  EXPECT_FALSE(summary["comparison"].is_null()) << "its INS is compared with";
}

// In real time: images are dropped as this machine is busy, and the solver answers when it is done.
TEST(Recorded, realTimeRunReplaysBitForBit) {
  const TemporaryFolder folder;
  const Outcome o = drive(folder / "live", "--from-scratch --duration 12 --set trigger.rate=10");
  ASSERT_LE(o.code, 1) << o.err;
  ASSERT_LE(replay(folder / "live", folder / "again").code, 1);
  expect_same_poses(folder / "live", folder / "again");
}

// In real time: with --fast the poses are ahead of the file that is written.
TEST(Recorded, everySplitFileHoldsCameraTransforms) {
  const TemporaryFolder folder;
  const Outcome o = drive(folder / "s", "--duration 3 --set record.split_mb=1");
  ASSERT_LE(o.code, 1) << o.err;
  for (const char* name : {"drive_0.mcap", "drive_1.mcap"}) {
    const auto file = test::read_mcap(folder / "s" / name);
    EXPECT_TRUE(std::any_of(file.messages.begin(), file.messages.end(), [](const auto& m) {
      return m.topic == "/tf_static";
    })) << name;
  }
}

/// A rectified drive with a truth that is a straight drive at constant speed and ends `short_ns`
/// before the last frame.
/// Speed in m/s.
constexpr double kSpeed = 40;
void drive_with_truth(const std::filesystem::path& session, std::int64_t short_ns) {
  const Outcome o =
      drive(session, "--fast --duration 2 --set rig.nominal.k1=0 --set rig.nominal.k2=0");
  ASSERT_LE(o.code, 1) << o.err;
  const std::int64_t end = app::read_tum(session / "trajectory.tum").back().stamp.ns() - short_ns;
  std::ofstream truth(session / "truth.tum");
  for (std::int64_t k = 60; k >= 0; --k) {
    const std::int64_t before_ns = k * 50'000'000;
    truth << app::format_seconds(end - before_ns) << " 0 0 "
          << -kSpeed * static_cast<double>(before_ns) * 1e-9 << " 0 0 0 1\n";
  }
}

// KITTI has a pose for every image; EuRoC's ground truth has stamps of its own.
TEST(RecordedTruth, framesBeyondTheTruthHaveNone) {
  const TemporaryFolder folder;
  drive_with_truth(folder / "s", 8'000);
  const auto frames = summary_of(folder / "s")["frames"]["read"].get<std::ptrdiff_t>();
  for (const std::string format : {"kitti", "euroc"}) {
    const Outcome o = export_to(folder / format, folder / "s", "--format " + format);
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_TRUE(test::mentions(o.err, "1 frames have no ground truth")) << o.err;
    ASSERT_TRUE(app::find_truth(folder / format)) << format;
    EXPECT_EQ(std::ssize(app::read_trajectory_file(*app::find_truth(folder / format)).poses),
              frames - 1);
    EXPECT_LE(replay(folder / format, folder / ("of-" + format)).code, 1);
    EXPECT_EQ(summary_of(folder / ("of-" + format))["frames"]["read"],
              format == "kitti" ? frames - 1 : frames);
  }
}

TEST(Recorded, recordedPulsesLeaveThePosesUnchanged) {
  const TemporaryFolder folder;
  const std::string chain = "run '" + std::string(VERGENCE_SOURCE_DIR) +
                            "/app/config/mock_board.yaml' --fast --duration 4" + test::kSmall;
  const Outcome plain = run_vergence(chain + " --out '" + (folder / "plain").string() + "'");
  ASSERT_LE(plain.code, 1) << plain.err;
  const Outcome o =
      run_vergence(chain + " --record pulses --out '" + (folder / "recorded").string() + "'");
  ASSERT_LE(o.code, 1) << o.err;
  expect_same_poses(folder / "plain", folder / "recorded");
  const auto summary = summary_of(folder / "recorded");
  EXPECT_EQ(summary["devices"]["recording_dropped"], 0);
  EXPECT_EQ(summary["runtime_allocations"], 0);
  std::vector<std::uint64_t> numbers;
  for (const auto& m : test::read_mcap(folder / "recorded" / "drive.mcap").messages) {
    if (m.topic != "/vergence/pulse") continue;
    // Behind the encapsulation: a stamp of 8 bytes, the text "board" (4 + 6), and then 8-aligned.
    std::uint64_t number = 0;
    ASSERT_GE(m.content.size(), 36U);
    std::memcpy(&number, m.content.data() + 4 + 24, sizeof number);
    numbers.push_back(number);
  }
  ASSERT_GE(numbers.size(), summary["frames"]["read"].get<std::size_t>());
  for (std::size_t i = 1; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], numbers[i - 1] + 1);
}

}  // namespace
}  // namespace vergence
