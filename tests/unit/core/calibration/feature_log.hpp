#pragma once

#include "core/calibration/rig_solver.hpp"
#include "tests/support/feature_drive.hpp"

namespace vergence::test {

/// The street of a feature drive without any error in its tracks.
[[nodiscard]] inline FeatureDriveOptions exact_drive() {
  FeatureDriveOptions o;
  o.white_px = o.constant_px = o.walk_px = o.bias_px = o.outliers = o.movers = 0;
  return o;
}

/// The rig of a feature drive as a calibration: cameras of these intrinsics, each number of them
/// known to its sigma (px).
[[nodiscard]] inline RigCalibration rig_of(const FeatureDriveOptions& drive,
                                           const std::array<Pinhole, 2>& lenses,
                                           const std::array<double, 4>& sigma) {
  RigCalibration rig{.cameras = 2};
  for (std::size_t k = 0; k < 2; ++k) {
    Intrinsics& c = rig.intrinsics[k];
    c.width = drive.width, c.height = drive.height;
    c.fx = lenses[k].fx, c.fy = lenses[k].fy, c.cx = lenses[k].cx, c.cy = lenses[k].cy;
    c.sigma = sigma;
  }
  rig.T_camera_left[1] = drive.T_right_left;
  rig.baseline = drive.T_right_left.t.norm();
  return rig;
}
/// Rig with exact intrinsics.
[[nodiscard]] inline RigCalibration rig_of(const FeatureDriveOptions& drive) {
  // A sigma of zero px would mean that the intrinsics are unknown.
  constexpr double kExact = 1e-6;
  return rig_of(drive, {drive.left, drive.right}, {kExact, kExact, kExact, kExact});
}

/// Another camera that sees every track, with the left one's lens and a third of a pixel of noise.
struct FurtherCamera {
  // With number 1 the drive's right camera becomes camera 2.
  std::size_t number = 2;
  Transform T_camera_left;
};

/// The rig of a drive that was logged with another camera.
[[nodiscard]] inline RigCalibration rig_of(const FeatureDriveOptions& drive,
                                           const FurtherCamera& further) {
  RigCalibration rig = rig_of(drive);
  rig.cameras = 3;
  rig.intrinsics[2] = rig.intrinsics[1];
  rig.T_camera_left[further.number == 1 ? 2 : 1] = drive.T_right_left;
  rig.T_camera_left[further.number] = further.T_camera_left;
  rig.baseline = rig.T_camera_left[1].t.norm();
  return rig;
}

/// Errors of the logged poses and transforms, from which a solve starts; tracks have errors of
/// their own.
struct LogStart {
  // Sigma of each axis of every frame's pose except the first.
  double pose_rad = 0, pose_m = 0;
  // Sigma of each axis of every frame's T_camera_left.
  double rig_rad = 0, rig_m = 0;
};

/// The next `frames` frames of a drive as the estimator would log them; how far they drive, m.
inline double log_drive(FeatureDrive& drive, int frames, const LogStart& start,
                        calibration::TrackLog& log, const FurtherCamera* further = nullptr) {
  Random random(drive.options().seed, 5), of_further(drive.options().seed, 7);
  const std::size_t right = further != nullptr && further->number == 1 ? 2 : 1;
  const auto vector = [&](double sigma) {
    return Vec3(sigma * Vec3(random.normal(), random.normal(), random.normal()));
  };
  double driven = 0;
  Vec3 before = Vec3::Zero();
  for (int i = 0; i < frames; ++i) {
    drive.next();
    const Vec3 centre = drive.T_left_world().centre();
    if (i > 0) driven += (centre - before).norm();
    before = centre;
    calibration::LoggedFrame f;
    f.number = drive.frame();
    f.stamp = drive.stamp();
    f.T_left_world =
        i == 0 ? drive.T_left_world()
               : perturbed(drive.T_left_world(), vector(start.pose_rad), vector(start.pose_m));
    f.T_camera_left[right] =
        perturbed(drive.T_right_left(), vector(start.rig_rad), vector(start.rig_m));
    if (further != nullptr) f.T_camera_left[further->number] = further->T_camera_left;
    f.unlinked = true;
    f.reprojection_px = 0.5;
    f.stereo = static_cast<int>(drive.tracks().size());
    log.begin(f);
    for (const FeatureTrack& t : drive.tracks()) {
      calibration::LoggedObservation s{
          .track = t.id, .cameras = t.seen, .sigma = static_cast<float>(t.sigma_px)};
      s.raw[0] = t.left.cast<float>();
      s.raw[right] = t.right.cast<float>();
      if (further != nullptr) {
        const Pinhole& lens = drive.options().left;
        const Vec3 p = further->T_camera_left * (drive.T_left_world() * t.p_world);
        const double noise = drive.options().white_px;
        s.cameras = 0b111;
        s.raw[further->number] =
            Vec2(lens.fx * p.x() / p.z() + lens.cx + noise * of_further.normal(),
                 lens.fy * p.y() / p.z() + lens.cy + noise * of_further.normal())
                .cast<float>();
      }
      log.push(s);
    }
  }
  return driven;
}

/// A RigSolver with its memory.
struct SolverInArena {
  calibration::CalibrationOptions options;
  calibration::MonitorOptions monitor;
  Arena arena;
  calibration::RigSolver solver;
  explicit SolverInArena(const calibration::CalibrationOptions& o, int cameras = 2)
      : options(o), solver(options, monitor, cameras, kFeatures, arena) {}
  static constexpr std::size_t kFeatures = 300;
};

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;
/// Rotation and the two coordinates of t that the known length leaves: along the baseline there is
/// nothing to find.
[[nodiscard]] inline Vec5 five_errors(const RigCalibration& found, const Transform& truth) {
  Vec5 e;
  e << log_so3(found.T_camera_left[1].R * truth.R.transpose()),
      (found.T_camera_left[1].t - truth.t).tail<2>();
  return e;
}
[[nodiscard]] inline Mat5 five_covariance(const Mat6& C) {
  constexpr std::array<int, 5> kWhich = {0, 1, 2, 4, 5};
  Mat5 out;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j)
      out(i, j) = C(kWhich[static_cast<std::size_t>(i)], kWhich[static_cast<std::size_t>(j)]);
  return out;
}

}  // namespace vergence::test
