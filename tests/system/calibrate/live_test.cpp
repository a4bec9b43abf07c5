// `vergence calibrate live CONFIG` on real GigE Vision over the loopback: a drawn board before two
// simulated cameras.

#include "app/config/calibration_file.hpp"
#include "tests/support/gige_pair.hpp"
#include "tests/support/refusal.hpp"
#include "tests/system/gige/socket_buffer.hpp"
#include "tests/unit/app/checkerboard/board_picture.hpp"
#include "tests/unit/app/checkerboard/board_scene.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

const app::BoardPattern kBoard = app::parse_checkerboard("9x6", 0.04);
/// Trigger rate in Hz.
constexpr double kRate = 5;
/// Images of one pose: enough time to find the checkerboard twice on a busy machine.
constexpr std::uint64_t kHeldFor = 8;

TEST(CalibrateLive, movedCheckerboardGivesCompleteCalibration) {
  if (const std::string why = socket_buffer_obstacle(); !why.empty()) GTEST_SKIP() << why;
  const RigCalibration truth = known_rig(2, CameraModelKind::pinhole_radtan);
  const auto poses = shown_around(kBoard, truth);
  std::vector<std::vector<std::uint8_t>> images[2];
  for (std::size_t k = 0; k < 2; ++k) {
    const BoardPainter painter(truth.intrinsics[k]);
    for (const Transform& T : poses)
      images[k].push_back(painter.paint(kBoard, truth.T_camera_left[k] * T));
  }
  const GigePair cameras("BOARD", 0, 640, 480, [&images](std::size_t k, std::uint64_t n) {
    return images[k][(n / kHeldFor) % images[k].size()].data();
  });
  std::jthread pulses = cameras.pulses(kRate);
  const TemporaryFolder folder;
  const auto out = folder / "calibration.yaml", views = folder / "views";
  const Outcome o = run_vergence(
      fmt::format("calibrate live '{}/app/config/gige.yaml' --checkerboard 9x6 --square 0.04 "
                  "--out '{}' --keep-views '{}' --set trigger.rate={} "
                  "--set rig.nominal.baseline_m=0.12 --set rig.nominal.focal_px=520{}",
                  VERGENCE_SOURCE_DIR, out.string(), views.string(), kRate, cameras.settings()));
  pulses = {};
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(test::mentions(o.out, "Nothing is missing"));
  const app::CalibrationFile c = app::read_calibration(out);
  EXPECT_EQ(c.serials[0], "BOARD-0");
  EXPECT_GE(c.rig.frames, 12);
  const Vec6 off = place_error(c.rig.T_camera_left[1], truth.T_camera_left[1]);
  EXPECT_LT(off.head<3>().norm(), 0.15 * M_PI / 180);
  EXPECT_LT(off.tail<3>().norm(), 0.0005) << "m";

  // The saved images give the same calibration.
  const Outcome again =
      run_vergence(fmt::format("calibrate target --quiet --left '{0}/left_*.png' --right "
                               "'{0}/right_*.png' --checkerboard 9x6 --square 0.04 --out '{1}'",
                               views.string(), (folder / "again.yaml").string()));
  ASSERT_EQ(again.code, 0) << again.err;
  const app::CalibrationFile same = app::read_calibration(folder / "again.yaml");
  EXPECT_LT(place_error(same.rig.T_camera_left[1], c.rig.T_camera_left[1]).norm(), 1e-4);
}

}  // namespace
}  // namespace vergence::test
