#include <gtest/gtest.h>

#include "core/camera/camera.hpp"
#include "core/math/so3.hpp"
#include "core/odometry/odometry.hpp"
#include "tests/system/odometry/estimator_run.hpp"

namespace vergence::test {
namespace {

/// Every frame is usable, and none has an error beyond the bound of an `ok` pose.
void expect_usable(const StereoDrive& drive, const EstimatorRun& run) {
  EXPECT_EQ(count_usable(run.results(), 0, drive.size()), static_cast<int>(drive.size()))
      << run.describe();
  EXPECT_EQ(false_ok(run.results()), "");
}

TEST(OdometryAccuracy, driveIsOkAndWithinFourPerMille) {
  // One pair measures a point 15 m away (27 px of disparity) to 15 m · 0.15 · √2 px / 27 px =
  // 0.12 m, a hundred of them the step's path to 12 mm; a keyframe hands that on every metre or so,
  // and the window ties five to ten of them together: 10 m come to some 20 to 40 mm, 0.2 to 0.4 %.
  // A fault of scale, of the lens model or of the rig's transform would show as a per cent and
  // more.
  constexpr double kShare = 0.004;
  // rad/m: a hundred directions of 0.15 px / 550 px each, per keyframe, over 10 m; ten times that.
  constexpr double kTurnPerMetre = 0.0005;
  EstimatorRun run(with_supplied(brief_drive().rig));
  run.process(brief_drive());
  expect_usable(brief_drive(), run);
  const TrajectoryEvaluation e = evaluate_results(run.results(), {10, 20, 30, 40});
  ASSERT_EQ(e.status, EvaluationStatus::ok);
  EXPECT_GT(e.path_reference, 50.0);
  EXPECT_GT(e.segments[0].count, 200U);
  EXPECT_LT(e.segments[0].translation, kShare);
  EXPECT_LT(e.segments[0].rotation, kTurnPerMetre);
  EXPECT_LT(e.end_error_ratio, kShare);
  EXPECT_NEAR(e.sim3.scale, 1.0, kShare);
}

TEST(OdometryAccuracy, standingRigDoesNotMove) {
  RenderedDriveOptions options = brief_options(distorted_rig(), 0);
  options.drive.kind = mock::DriveKind::still;
  const StereoDrive still = render(options, 60);
  EstimatorRun run(with_supplied(still.rig));
  run.process(still);
  expect_usable(still, run);
  double furthest = 0, turned = 0;
  for (const FrameResult& r : run.results()) {
    const MotionError e = motion_error(run.results().front(), r);
    furthest = std::max(furthest, e.translation);
    turned = std::max(turned, e.rotation);
  }
  // All frames are measured against the same keyframe: the noise of one frame, a hundred points of
  // 15 m and 0.15 px, four sigmas.
  EXPECT_LT(furthest, 0.012);
  EXPECT_LT(turned, 4 * 0.15 / 550 / 10);
}

/// 120° across, 150° from corner to corner: pinhole-equidistant lenses.
RigCalibration fisheye_rig() {
  RigCalibration rig = distorted_rig();
  for (Intrinsics& c : rig.intrinsics) {
    c.kind = CameraModelKind::pinhole_equidistant;
    c.fx = c.fy = 305.0;
    c.distortion = {0.0034, 0.0008, -0.0002, 0.00002, 0};
  }
  return rig;
}

const StereoDrive& fisheye_drive() {
  static const StereoDrive drive = render(brief_options(fisheye_rig(), 1.5), 200);
  return drive;
}

TEST(FisheyeRig, driveIsOkAndWithinOnePercent) {
  const StereoDrive& drive = fisheye_drive();
  // The image's edge is where it is meant to be: 60° from the axis at half the width, but for the
  // distortion.
  Vec3 ray;
  ASSERT_TRUE(Camera(drive.rig.intrinsics[0]).unproject(Vec2(639, 241), &ray));
  ASSERT_NEAR(std::atan(ray.x()) * 180 / std::numbers::pi, 60, 1.0);

  EstimatorRun run(with_supplied(drive.rig));
  run.process(drive);
  expect_usable(drive, run);
  const TrajectoryEvaluation e = evaluate_results(run.results(), {10, 20, 30});
  ASSERT_EQ(e.status, EvaluationStatus::ok);
  ASSERT_GT(e.path_reference, 40.0);
  // A pixel is 1.8 times the angle that it is with lenses of 550 px, and so is every error of depth
  // and path.
  EXPECT_LT(e.segments[0].translation, 0.0075);
  EXPECT_LT(e.segments[0].rotation, 0.001);
  EXPECT_NEAR(e.sim3.scale, 1.0, 0.0075);
}

TEST(FisheyeRig, extrinsicsAreFoundFromTheDrive) {
  const StereoDrive& drive = fisheye_drive();
  EstimatorRunOptions options = from_scratch(drive.rig);
  options.options.calibration = {};
  EstimatorRun run(options);
  run.process(drive);
  run.finish();
  ASSERT_TRUE(run.estimator().calibrated()) << run.describe();
  const Transform &found = run.estimator().calibration().T_camera_left[1],
                  &real = drive.rig.T_camera_left[1];
  const Vec3 turn = log_so3(found.R * real.R.transpose());
  // Three of the sigmas below which a calibration is accepted: 0.15 mrad an axis, 4 mm along y and
  // along z.
  EXPECT_LT(turn.cwiseAbs().maxCoeff(), 3 * 0.15e-3);
  EXPECT_LT((found.t - real.t).cwiseAbs().maxCoeff(), 3 * 0.004);
  const auto posed =
      std::count_if(run.results().begin(), run.results().end(),
                    [](const FrameResult& r) { return r.sample.status != PoseStatus::lost; });
  EXPECT_GT(posed, static_cast<int>(drive.size()) * 9 / 10);
}

// Conditions that last from the start or to the end; tests/system/faults has those that pass.

/// The image of a camera in the dark: black level and a grey level of noise.
features::test::Image dark_image(std::uint64_t seed) {
  // Both are in grey levels.
  constexpr double kBlackLevel = 6.0, kNoise = 1.0;
  features::test::Image p(640, 480);
  Random random(seed);
  for (std::uint8_t& b : p.bytes)
    b = static_cast<std::uint8_t>(
        std::clamp(std::lround(kBlackLevel + kNoise * random.normal()), 0L, 255L));
  return p;
}

TEST(OdometryInBadConditions, cameraCoveredForGoodIsNeverOkAgain) {
  constexpr std::size_t kCovered = 20;
  const std::array dark{dark_image(1), dark_image(2), dark_image(3), dark_image(4)};
  for (const std::size_t camera : {0U, 1U}) {
    EstimatorRun run(with_supplied(brief_drive().rig));
    run.process(brief_drive(), 0, brief_drive().size(), [&](std::size_t i, RigFrame* f) {
      if (i >= kCovered) f->images[camera] = dark[i % dark.size()].view();
      return true;
    });
    EXPECT_EQ(count_usable(run.results(), 0, kCovered), static_cast<int>(kCovered));
    EXPECT_EQ(count_usable(run.results(), kCovered, brief_drive().size()), 0) << run.describe();
    EXPECT_EQ(run.results().back().sample.reason, Reason::image_no_contrast);
    EXPECT_EQ(run.allocations(), 0U);
  }
}

TEST(OdometryInBadConditions, camerasSwappedFromTheStartGiveNoPose) {
  EstimatorRunOptions options = with_supplied(brief_drive().rig);
  // Online calibration would calibrate the swapped rig.
  options.options.online = false;
  EstimatorRun run(options);
  run.process(brief_drive(), 0, brief_drive().size(), [](std::size_t, RigFrame* f) {
    std::swap(f->images[0], f->images[1]);
    return true;
  });
  int swapped = 0;
  for (const FrameResult& r : run.results()) {
    EXPECT_EQ(r.sample.status, PoseStatus::lost) << run.describe();
    swapped += r.sample.reason == Reason::cameras_swapped ? 1 : 0;
  }
  EXPECT_GT(swapped, 0) << "somewhere on the way there is enough near the rig to detect it";
}

using features::test::Image;

constexpr std::size_t kFrames = 120;
/// Height in rows.
constexpr int kBonnet = 110;
const std::array<Eigen::Vector2i, 2> kDirt{Eigen::Vector2i(210, 170), Eigen::Vector2i(430, 205)};
/// Radius in px.
constexpr int kDirtRadius = 38;

/// Part of camera k's image that is not the street: the bonnet, dirt on the glass.
bool is_painted(std::size_t k, int x, int y, int height) {
  return y >= height - kBonnet ||
         (Eigen::Vector2i(x, y) - kDirt[k]).squaredNorm() < kDirtRadius * kDirtRadius;
}

/// Static things with more texture than the street has: rivets, grains, reflections.
Image paint(int width, int height) {
  Image p(width, height);
  Random random(7);
  for (int y = 0; y < height; y += 4)
    for (int x = 0; x < width; x += 4) {
      const auto grey = static_cast<std::uint8_t>(random.below(256));
      for (int v = y; v < std::min(y + 4, height); ++v)
        for (int u = x; u < std::min(x + 4, width); ++u) p.at(u, v) = grey;
    }
  return p;
}

/// The brief drive as a rig with a bonnet and dirt in its pictures sees it.
class DirtyDrive {
 public:
  DirtyDrive() : drive_(brief_drive()) {
    const Intrinsics& c = drive_.rig.intrinsics[0];
    // Identical paint in both images matches at infinity.
    const Image dirt = paint(c.width, c.height);
    for (std::size_t k = 0; k < 2; ++k) {
      for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x)
          masks_[k].at(x, y) = is_painted(k, x, y, c.height) ? 0 : 255;
    }
    for (std::size_t i = 0; i < kFrames; ++i) {
      pairs_.push_back(drive_.pairs[i]);
      for (std::size_t k = 0; k < 2; ++k) {
        std::vector<std::uint8_t>& bytes = pairs_.back()[k].bytes;
        for (std::size_t b = 0; b < bytes.size(); ++b)
          if (masks_[k].bytes[b] == 0) bytes[b] = dirt.bytes[b];
      }
    }
  }
  [[nodiscard]] std::array<ImageView, 2> masks() const {
    return {masks_[0].view(), masks_[1].view()};
  }
  [[nodiscard]] RigFrame frame(std::size_t i, bool dirty) const {
    RigFrame f = drive_.frame(i);
    for (std::size_t k = 0; dirty && k < 2; ++k) f.images[k] = pairs_[i][k].view();
    return f;
  }
  [[nodiscard]] const StereoDrive& drive() const { return drive_; }

 private:
  const StereoDrive& drive_;
  std::array<Image, 2> masks_{Image(640, 480), Image(640, 480)};
  std::vector<std::array<Image, 2>> pairs_;
};

const DirtyDrive& dirty_drive() {
  static const DirtyDrive drive;
  return drive;
}

struct Passed {
  /// Observations by camera, and those of them on painted pixels.
  std::array<int, 2> observations{}, painted{};
  int posed = 0;
  Transform T_left_world{};
  /// Error in m of the motion from the first frame to the last.
  double error = 0;
};

Passed pass(bool dirty, std::span<const ImageView> masks) {
  const DirtyDrive& d = dirty_drive();
  const StereoDrive& truth = d.drive();
  OdometryOptions options;
  Arena arena;
  SequentialRunner runner;
  odometry::Odometry odometry(options, truth.rig, true, arena, runner, masks);
  Passed passed;
  for (std::size_t i = 0; i < kFrames; ++i) {
    const odometry::FrameOutcome out = odometry.process(d.frame(i, dirty));
    if (out.posed) ++passed.posed;
    passed.T_left_world = out.T_left_world;
    for (const odometry::MapPoint& p : odometry.map().points())
      for (int k = 0; p.followed() && k < 2; ++k) {
        if (!p.now.by(k)) continue;
        const auto c = static_cast<std::size_t>(k);
        const int x = static_cast<int>(std::lround(p.raw[c].x())),
                  y = static_cast<int>(std::lround(p.raw[c].y()));
        ++passed.observations[c];
        passed.painted[c] += is_painted(c, x, y, truth.rig.intrinsics[0].height) ? 1 : 0;
      }
  }
  const Transform truly = truth.truth[kFrames - 1].inverse() * truth.truth[0];
  passed.error = ((truly.inverse() * passed.T_left_world).t).norm();
  return passed;
}

TEST(MaskedOdometry, usesNothingUnderMaskAndStaysAccurate) {
  const double way =
      (dirty_drive().drive().truth[kFrames - 1].t - dirty_drive().drive().truth[0].t).norm();
  ASSERT_GT(way, 15.0);
  const Passed clean = pass(false, {});
  const auto masks = dirty_drive().masks();
  const Passed masked = pass(true, masks);
  const Passed bare = pass(true, {});
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(masked.painted[k], 0) << "camera " << k;
    EXPECT_GT(masked.observations[k], static_cast<int>(kFrames) * 100) << "camera " << k;
    // Without the mask the paint is tracked.
    EXPECT_GT(bare.painted[k], static_cast<int>(kFrames)) << "camera " << k;
  }
  EXPECT_EQ(masked.posed, static_cast<int>(kFrames));
  // As for clean images: 4 per mille of the path, and the first metre's
  // share of a keyframe.
  EXPECT_LT(clean.error, 0.004 * way + 0.02);
  EXPECT_LT(masked.error, 0.004 * way + 0.02);
}

}  // namespace
}  // namespace vergence::test
