#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/system/replay/replayed_folder.hpp"

namespace vergence::test {
namespace {

TEST_F(ReplayedFolder, aMaskChangesWhatIsSeenAndOneOfAnotherSizeIsRefused) {
  const std::string white(640 * 480, '\xff');
  const fs::path bonnet = work_.write(
      "bonnet.pgm", "P5 640 480 255\n" + white.substr(0, 640 * 400) + std::string(640 * 80, '\0'));
  const fs::path small = work_.write("small.pgm", "P5 320 240 255\n" + white.substr(0, 320 * 240));
  const Outcome o = replay("--set cameras.0.mask=" + bonnet.string() +
                           " --set cameras.1.mask=" + bonnet.string());
  ASSERT_EQ(o.code, 0) << o.err;
  const std::string masked = read_file(session() / "poses.csv");
  EXPECT_EQ(summary()["frames"]["posed"], kFrames);
  fs::remove_all(session());
  ASSERT_EQ(replay().code, 0);
  EXPECT_NE(read_file(session() / "poses.csv"), masked);
  fs::remove_all(session());
  const Outcome refused = replay("--set cameras.1.mask=" + small.string());
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("cameras.1.mask: " + small.string() +
                             " is 320 × 240 px, the camera's images are 640 × 480"),
            std::string::npos)
      << refused.err;
}

TEST_F(ReplayedFolder, givesASessionWithAPoseForEveryFrame) {
  const Outcome o = replay();
  ASSERT_EQ(o.code, 0) << o.err;
  for (const char* file : {"trajectory.tum", "poses.csv", "calibration.yaml", "calibrations.csv",
                           "events.jsonl", "summary.json", "report.html"})
    EXPECT_TRUE(fs::exists(session() / file)) << file;
  const auto s = summary();
  EXPECT_EQ(s["frames"]["posed"], kFrames);
  EXPECT_EQ(s["frames"]["skipped"], 0);
  EXPECT_EQ(s["allocations_after_seal"], 0);
  EXPECT_TRUE(s["metrics"].is_null());  // a plain folder has no truth
}

TEST_F(ReplayedFolder, aDriveTooShortToConfirmItsCalibrationSaysSo) {
  // A calibration that is given is judged with 20 frames for the first time.
  const Outcome o = run_vergence("replay '" + data().string() + "' --format folder --frames 18 " +
                                 "--out '" + session().string() + "'");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(summary()["calibration"]["verified"], false);
  EXPECT_TRUE(summary()["calibration"]["verified_frame"].is_null());
  EXPECT_NE(o.err.find("the drive has not confirmed its calibration"), std::string::npos) << o.err;
  EXPECT_NE(read_file(session() / "poses.csv").find("degraded,unverified_calibration"),
            std::string::npos);
  EXPECT_NE(read_file(session() / "report.html").find("not verified"), std::string::npos);
}

TEST_F(ReplayedFolder, theSameBytesWithOneThreadAndTwo) {
  ASSERT_EQ(replay("--threads 1").code, 0);
  const fs::path other = work_ / "other";
  ASSERT_EQ(run_vergence("replay '" + data().string() +
                         "' --format folder --quiet --threads 2 --out '" + other.string() + "'")
                .code,
            0);
  EXPECT_EQ(read_file(session() / "trajectory.tum"), read_file(other / "trajectory.tum"));
  EXPECT_EQ(read_file(session() / "events.jsonl"), read_file(other / "events.jsonl"));
}

TEST_F(ReplayedFolder, fromScratchIntrinsicsAndALengthAreEnough) {
  std::string text = read_file(data() / "calibration.yaml");
  const auto at = text.find("    T_camera_left: [");
  ASSERT_NE(at, std::string::npos);
  text.erase(at, text.find('\n', at) + 1 - at);
  write("calibration.yaml", text);
  expect_refused("T_camera_left");
  fs::remove_all(session());
  const Outcome o = replay("--from-scratch");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(summary()["frames"]["posed"], kFrames);
  EXPECT_TRUE(summary()["calibration"]["before"].is_null());
}

TEST_F(ReplayedFolder, whatIsMissingNamesTheWayOut) {
  std::string text = read_file(data() / "calibration.yaml");
  const auto at = text.find("    T_camera_left: [");
  text.erase(at, text.find('\n', at) + 1 - at);
  write("calibration.yaml", text);
  expect_refused("--from-scratch");
  fs::remove_all(session());
  write("calibration.yaml", text + "\n");
  text.insert(at, "    T_left_camera: [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0]\n");
  write("calibration.yaml", text);
  expect_refused("T_left_camera is the inverse of what is read: give T_camera_left");
}

TEST_F(ReplayedFolder, theLayoutIsFoundOut) {
  const Outcome o =
      run_vergence("replay '" + data().string() + "' --quiet --out '" + session().string() + "'");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(summary()["frames"]["posed"], kFrames);
  fs::create_directories(work_ / "nothing");
  const Outcome none = run_vergence("replay '" + (work_ / "nothing").string() + "' --out x");
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.err.find("holds no drive that is known: KITTI (image_0"), std::string::npos)
      << none.err;
}

TEST_F(ReplayedFolder, aReferenceBesideTheImagesIsComparedWith) {
  ASSERT_EQ(replay().code, 0);
  EXPECT_FALSE(fs::exists(session() / "reference.tum")) << "there was none";
  fs::copy(session() / "trajectory.tum", data() / "truth.tum");
  fs::remove_all(session());
  ASSERT_EQ(replay().code, 0);
  EXPECT_LT(summary()["metrics"]["ate_m"].get<double>(), 1e-6);
  EXPECT_TRUE(fs::exists(session() / "reference.tum"));
}

TEST_F(ReplayedFolder, focalLengthAndBaselineNeedEachOther) {
  for (const char* bad : {"--focal 500", "--focal 5 --baseline 0.5",

                          "--focal 500 --baseline 0.5 --calibration c.yaml"}) {
    const Outcome o = replay(bad);
    EXPECT_EQ(o.code, 2) << bad << o.err;
    EXPECT_NE(o.err.find("--"), std::string::npos) << bad;
    EXPECT_FALSE(fs::exists(session())) << bad;
  }
}

TEST_F(ReplayedFolder, aBaselineGivenScalesTheWay) {
  ASSERT_EQ(replay().code, 0);
  const double way = summary()["path_m"], length = summary()["calibration"]["baseline_m"];
  fs::remove_all(session());
  const Outcome o = replay(fmt::format("--baseline {}", 2 * length));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_NEAR(summary()["path_m"].get<double>(), 2 * way, 0.02 * way);
  EXPECT_NEAR(summary()["calibration"]["baseline_m"].get<double>(), 2 * length, 1e-9);
  EXPECT_EQ(run_vergence("replay x --format folder --out y --baseline 0").code, 2);
}

TEST_F(ReplayedFolder, whatIsWrongWithAFrameCostsThatFrame) {
  const fs::path left = data() / image_name(0, 3);
  std::string times = read_file(data() / "times.txt");
  const std::size_t line = times.find('\n') + 1;
  for (const std::function<void()>& spoil : std::initializer_list<std::function<void()>>{
           [&] { fs::remove(data() / image_name(1, 9)); },
           [&] { fs::resize_file(left, fs::file_size(left) / 2); },
           [&] { cv::imwrite(left.string(), cv::Mat(100, 100, CV_8U, cv::Scalar(90))); },
           [&] { write("times.txt", times.replace(12 * line, line, times.substr(0, line))); }}) {
    fs::remove_all(data()), fs::remove_all(session());
    fs::copy(*master_ / ".", data(), fs::copy_options::recursive);
    spoil();
    expect_skipped(1);
  }
}

TEST_F(ReplayedFolder, imagesOfTwelveBitsInSixteenGiveThePosesOfTheirEight) {
  const auto rewrite = [this](int depth) {
    for (std::size_t i = 0; i < kFrames; ++i)
      for (int k = 0; k < 2; ++k) {
        const std::string file = (data() / image_name(k, i)).string();
        cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE), out;
        image.at<std::uint8_t>(0, 0) = 255;  // of twelve bits the greatest
        image.convertTo(out, depth, depth == CV_16U ? 16 : 1, depth == CV_16U ? 15 : 0);
        ASSERT_TRUE(cv::imwrite(file, out));
      }
  };
  rewrite(CV_8U);
  ASSERT_EQ(replay().code, 0);
  const std::string poses = read_file(session() / "trajectory.tum");
  fs::remove_all(session());
  rewrite(CV_16U);
  const Outcome o = replay();
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(read_file(session() / "trajectory.tum") == poses);
  EXPECT_NE((o.err + read_file(session() / "events.jsonl")).find("of which 12 are used"),
            std::string::npos)
      << o.err;
}

TEST_F(ReplayedFolder, ofImagesThatAreMissingAThousandAreListedAndTheRestCounted) {
  constexpr std::size_t kMissing = 1300;
  std::string times;
  for (std::size_t i = 0; i < kFrames + kMissing; ++i)
    times += fmt::format("{},{:03d}.png\n", 1'577'836'800'000'000'000 + 50'000'000 * i, i);
  std::ofstream(data() / "times.txt") << times;
  const Outcome o = replay();
  ASSERT_TRUE(fs::exists(session() / "events.jsonl")) << o.err;
  std::size_t listed = 0;
  std::istringstream events(read_file(session() / "events.jsonl"));
  std::string last;
  for (std::string line; std::getline(events, line);)
    if (line.find("image_missing") != std::string::npos) ++listed, last = line;
  EXPECT_EQ(listed, 1001U);
  EXPECT_NE(last.find("1000 frames could not be read"), std::string::npos) << last;
  EXPECT_EQ(summary()["frames"]["skipped"], kMissing);
}

}  // namespace
}  // namespace vergence::test
