#include "tests/system/odometry/stereo_drive.hpp"

#include "core/math/so3.hpp"

namespace vergence::test {

RigFrame StereoDrive::frame(std::size_t i) const {
  RigFrame frame{.number = i, .stamp = stamps[i], .cameras = 2};
  for (std::size_t k = 0; k < 2; ++k) frame.images[k] = pairs[i][k].view();
  return frame;
}

StereoDrive render(const RenderedDriveOptions& options, std::size_t frames) {
  StereoDrive out;
  out.rig = options.rig;
  RenderedDrive drive(options);
  for (std::size_t i = 0; i < frames; ++i) {
    const RigFrame& frame = drive.frame(i);
    out.stamps.push_back(frame.stamp);
    out.pairs.push_back(
        {features::test::copy_of(frame.images[0]), features::test::copy_of(frame.images[1])});
    out.truth.push_back(drive.T_enu_left(i));
  }
  return out;
}

RigCalibration distorted_rig() {
  RigCalibration rig{.cameras = 2};
  rig.intrinsics[0] = rig.intrinsics[1] = {.width = 640,
                                           .height = 480,
                                           .fx = 550,
                                           .fy = 550,
                                           .distortion = {-0.21, 0.06, 0.0004, -0.0003, 0}};
  rig.intrinsics[0].cx = 318.7, rig.intrinsics[0].cy = 241.2;
  rig.intrinsics[1].cx = 323.1, rig.intrinsics[1].cy = 237.9;
  rig.T_camera_left[1] = {exp_so3(Vec3(0.004, -0.006, 0.003)), Vec3(-0.75, 0.003, 0.005)};
  rig.baseline = rig.T_camera_left[1].t.norm();
  return rig;
}

RenderedDriveOptions brief_options(const RigCalibration& rig, double from_s) {
  return {.rig = rig,
          .drive = {.kind = mock::DriveKind::brief, .speed = 9, .stop_s = 1},
          .from_s = from_s,
          .rate = 20};
}

const StereoDrive& brief_drive() {
  static const StereoDrive drive = render(brief_options(distorted_rig(), 0.5), 240);
  return drive;
}

}  // namespace vergence::test
