#pragma once
#include <cstdint>

#include "app/session/records.hpp"
#include "tests/support/temporary_folder.hpp"

/// Inputs of a recorder in tests, and readers of its output.
namespace vergence::app {

/// Stamp in ns, whose last digits a double cannot hold.
inline constexpr std::int64_t kStamp = 1403636584763555584;

inline FrameReport pose(std::uint64_t frame, PoseStatus status, double x) {
  PoseSample sample;
  sample.frame = frame;
  sample.stamp = Stamp(kStamp + static_cast<std::int64_t>(frame) * 50'000'000);
  sample.state = State::stereo_odometry;
  sample.status = status;
  sample.reason = status == PoseStatus::ok ? Reason::none : Reason::few_inliers;
  sample.T_world_left.t = {x, 0, 0};
  sample.inliers = 100;
  sample.reprojection_px = 0.25;
  sample.estimate_ms = 7.5F;
  FrameReport report;
  report.pose = sample;
  report.decode_ms = 2;
  return report;
}

inline RigCalibration two_cameras() {
  RigCalibration rig{.cameras = 2};
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k] = {.width = 640, .height = 480, .fx = 460, .fy = 461, .cx = 320, .cy = 240};
  rig.T_camera_left[1].t = {-0.5, 0, 0.25};
  rig.sigma_noise[1] = {1e-4, 2e-4, 3e-4, 0.001, 0.002, 0.003};
  return rig;
}

inline CalibrationDecision decision(bool accepted) {
  CalibrationDecision d;
  d.stamp = Stamp(kStamp);
  d.cause = CalibrationCause::knock;
  d.accepted = accepted;
  d.reason = accepted ? "" : "held-out frames do not fit better";
  d.calibration = two_cameras();
  d.calibration.frames = 60;
  d.calibration.reprojection_px = 0.18;
  d.calibration.scale_sigma = 0.002;
  d.calibration.intrinsics[1].sigma = {0.2, 0.3, 0, 0};
  d.latency_frames = 71;
  d.onset_frame = 840;
  d.held_out_before_px = 1.5;
  d.held_out_after_px = 0.125;
  d.solve_ms = 33;
  return d;
}

}  // namespace vergence::app
