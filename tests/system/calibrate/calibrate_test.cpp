#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "app/config/calibration_file.hpp"
#include "tests/support/refusal.hpp"
#include "tests/unit/app/checkerboard/board_picture.hpp"
#include "tests/unit/app/checkerboard/board_scene.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

namespace fs = std::filesystem;

const app::BoardPattern kBoard = app::parse_checkerboard("9x6", 0.04);
constexpr const char* kArguments = " --checkerboard 9x6 --square 0.04";

/// Fourteen pairs of drawn boards as left/NN.png and right/NN.png, the layout of a folder that
/// `replay` takes.
class Calibrate : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const RigCalibration rig = known_rig(2, CameraModelKind::pinhole_radtan);
    const auto poses = shown_around(kBoard, rig);
    std::string times;
    for (std::size_t k = 0; k < 2; ++k) {
      const BoardPainter painter(rig.intrinsics[k]);
      fs::create_directories(*folder_ / (k == 0 ? "left" : "right"));
      for (std::size_t i = 0; i < 14; ++i) {
        auto pixels = painter.paint(kBoard, rig.T_camera_left[k] * poses[i]);
        const cv::Mat image(480, 640, CV_8U, pixels.data());
        ASSERT_TRUE(cv::imwrite(
            (*folder_ / fmt::format("{}/{:02}.png", k == 0 ? "left" : "right", i)).string(),
            image));
        if (k == 0) times += fmt::format("{}\n", 1'000'000'000 + 50'000'000 * i);
      }
    }
    (void)folder_->write("times.txt", times);
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string images() {
    return fmt::format(" --left '{0}/left/*.png' --right '{0}/right/*.png'",
                       folder_->path().string());
  }
  static fs::path file(const std::string& name) { return *folder_ / name; }

  static inline TemporaryFolder* folder_ = nullptr;
};

std::size_t messages(const std::string& text) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find("vergence: ", at)) != std::string::npos; at += 10) ++n;
  return n;
}

TEST_F(Calibrate, pairIsCalibratedFromFilesForAReplay) {
  const fs::path out = file("calibration.yaml");
  const Outcome o = run_vergence("calibrate target --quiet --json --baseline 0.121" + images() +
                                 kArguments + " --out '" + out.string() + "'");
  ASSERT_EQ(o.code, 0) << o.err;
  const auto json = nlohmann::json::parse(o.out);
  EXPECT_EQ(json["views"].size(), 14U);
  EXPECT_EQ(json["baseline"]["measured_m"], 0.121);
  ASSERT_EQ(json["cameras"].size(), 2U);
  EXPECT_EQ(json["cameras"][1]["place"]["rotation_deg"].size(), 3U);

  const app::CalibrationFile c = app::read_calibration(out);
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  EXPECT_EQ(c.source, "checkerboard");
  EXPECT_EQ(c.rig.frames, 14);
  // The detector's bias in drawn images, some hundredths of a pixel, is no noise: its sigmas are
  // not held against it.
  EXPECT_LT(c.rig.reprojection_px, 0.1);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(c.rig.intrinsics[k].fx / truth.intrinsics[k].fx, 1, 0.003);
    EXPECT_GT(c.rig.intrinsics[k].sigma[0], 0);
  }
  const Vec6 off = place_error(c.rig.T_camera_left[1], truth.T_camera_left[1]);
  EXPECT_LT(off.head<3>().norm(), 0.15 * M_PI / 180);
  EXPECT_LT(off.tail<3>().norm(), 0.0005) << "m";
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_GT(c.rig.sigma_noise[1][i], 0);
    EXPECT_NEAR(std::sqrt(c.rig.covariance_total[1](static_cast<int>(i), static_cast<int>(i))) /
                    c.rig.sigma_total[1][i],
                1, 1e-9);
  }

  const Outcome replay = run_vergence("replay '" + folder_->path().string() +
                                      "' --format folder --quiet --calibration '" + out.string() +
                                      "' --out '" + file("session").string() + "'");
  // The calibration is accepted, although boards that jump make no sequence.
  EXPECT_NE(replay.code, 2) << replay.err;
  EXPECT_TRUE(fs::exists(file("session") / "summary.json")) << replay.err;
}

TEST_F(Calibrate, singleCameraGivesIntrinsicsAndWarning) {
  const fs::path out = file("one.yaml");
  const Outcome o = run_vergence("calibrate target --quiet --left '" + file("left").string() +
                                 "/*.png'" + kArguments + " --out '" + out.string() + "'");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(test::mentions(read_file(out), "intrinsics: ["));
  EXPECT_TRUE(test::mentions(o.err, "it has one camera"));
}

TEST_F(Calibrate, wrongCheckerboardIsReportedOnce) {
  const Outcome o =
      run_vergence("calibrate target --quiet" + images() +
                   " --checkerboard 8x5 --square 0.04 --out '" + file("b.yaml").string() + "'");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(messages(o.err), 1U) << o.err;
  EXPECT_TRUE(test::mentions(o.err, "no view shows the target with 8x5 inner corners"));
}

TEST_F(Calibrate, badArgumentsGiveOneMessageAndExitTwo) {
  const std::string out = " --out '" + file("n.yaml").string() + "'",
                    target = "target --quiet" + images(), good = target + kArguments;
  for (const std::string& bad :
       {std::string(""), std::string("target"), good, target + out, good + out + " --baseline -1",
        good + " --out /proc/none/x.yaml", good + " --out ''",
        target + " --checkerboard 9 --square 0.04" + out,
        target + " --checkerboard 9x6 --square 0" + out,
        "target --left '/none/*.png'" + std::string(kArguments) + out, good + out + " --model omni",
        good + out + " --model equidistant --k3", std::string("convert onlyone"),
        "convert '" + file("left/00.png").string() + "' '" + file("b.yaml").string() + "'",
        "target --left '" + file("left/00.png").string() + "'" + kArguments + out}) {
    const Outcome o = run_vergence("calibrate " + bad);
    EXPECT_EQ(o.code, 2) << bad << "\n" << o.err;
    EXPECT_EQ(messages(o.err), 1U) << bad << "\n" << o.err;
    EXPECT_EQ(o.out, "") << bad;
  }
}

TEST_F(Calibrate, optionOfAnotherSubcommandIsRefused) {
  for (const auto& [words, option] : std::vector<std::pair<std::string, std::string>>{
           {"target --left l.png --keep-views d", "--keep-views"},
           {"live config.yaml --left l.png", "--left"},
           {"sequence d --square 0.04", "--square"},
           {"convert a b --model radtan", "--model"}}) {
    const Outcome o = run_vergence("calibrate " + words + " --out n.yaml");
    EXPECT_EQ(o.code, 2) << words;
    EXPECT_EQ(messages(o.err), 1U) << o.err;
    EXPECT_TRUE(test::mentions(o.err, words.substr(0, words.find(' ')), '"' + option + '"'));
  }
}

TEST_F(Calibrate, missingSubcommandIsSuggested) {
  for (const auto& [words, subcommand] : std::vector<std::pair<std::string, std::string>>{
           {"--quiet --checkerboard 9x6 --left l.png --right r.png", "target"},
           {"rig.yaml --checkerboard 9x6", "live"},
           {"--quiet rig.yaml --checkerboard 9x6", "live"},
           {"--quiet --drive data", "sequence"},
           {"--force --convert a b", "convert"},
           {"tagret --left-topic a", "target"}}) {
    const Outcome o = run_vergence("calibrate " + words);
    EXPECT_EQ(o.code, 2) << words;
    EXPECT_EQ(messages(o.err), 1U) << o.err;
    EXPECT_TRUE(test::mentions(o.err, subcommand)) << words;
  }
}

TEST_F(Calibrate, conversionReportsLossesAndNeedsForce) {
  const std::string f = folder_->path().string();
  app::CalibrationFile c;
  c.rig = known_rig(2, CameraModelKind::pinhole_equidistant);
  c.serials = {"15021234", "15021235", "", ""};
  app::write_calibration(file("ours.yaml"), c);
  const std::string convert =
      fmt::format("calibrate convert '{0}/ours.yaml' '{0}/back.txt' --to kalibr", f);
  Outcome o = run_vergence(convert);
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(test::mentions(o.err, "serial"));
  EXPECT_EQ(o.out, "");
  o = run_vergence(convert);
  EXPECT_EQ(o.code, 2) << "it is there already";
  EXPECT_TRUE(test::mentions(o.err, "--force"));
  o = run_vergence(convert + " --force");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(test::mentions(o.err, "back.txt: written as a Kalibr camchain"));
}

TEST_F(Calibrate, missingToolNamesItsPackage) {
  fs::copy_file(VERGENCE_PROGRAM, file("alone"));
  const auto alone = [](const std::string& arguments) {
    const std::string command = fmt::format("'{}' {} >'{}' 2>&1 </dev/null", file("alone").string(),
                                            arguments, file("said").string());
    const int status = std::system(command.c_str());
    return std::pair(WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(file("said")));
  };
  auto [code, said] = alone("calibrate target --quiet" + images() + kArguments + " --out '" +
                            file("none.yaml").string() + "'");
  EXPECT_EQ(code, 2);
  EXPECT_EQ(messages(said), 1U) << said;
  EXPECT_TRUE(test::mentions(said, "the package vergence-checkerboard"));
  std::tie(code, said) = alone("calibrate sequence nowhere --format folder --out '" +
                               file("none.yaml").string() + "'");
  EXPECT_EQ(code, 2);
  EXPECT_FALSE(test::contains(said, "vergence-checkerboard")) << said;
}

}  // namespace
}  // namespace vergence::test
