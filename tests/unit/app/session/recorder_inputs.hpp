#pragma once

#include "app/session/records.hpp"
#include "tests/support/temporary_folder.hpp"

/// Inputs of a recorder in tests, and readers of its output.
namespace vergence::app {

/// Stamp in ns, whose last digits a double cannot hold.
inline constexpr std::int64_t kStamp = 1403636584763555584;

inline FrameReport pose(std::uint64_t frame, PoseStatus status, double x) {
  FrameReport report;
  report.pose = {.frame = frame,
                 .stamp = Stamp(kStamp + static_cast<std::int64_t>(frame) * 50'000'000),
                 .state = State::stereo_odometry,
                 .status = status,
                 .reason = status == PoseStatus::ok ? Reason::none : Reason::few_inliers,
                 .T_world_left = {Mat3::Identity(), {x, 0, 0}},
                 .inliers = 100,
                 .reprojection_px = 0.25,
                 .estimate_ms = 7.5F};
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
  RigCalibration rig = two_cameras();
  rig.frames = 60;
  rig.reprojection_px = 0.18;
  rig.scale_sigma = 0.002;
  rig.intrinsics[1].sigma = {0.2, 0.3, 0, 0};
  return {.stamp = Stamp(kStamp),
          .cause = CalibrationCause::knock,
          .accepted = accepted,
          .reason = accepted ? "" : "held-out frames do not fit better",
          .calibration = rig,
          .latency_frames = 71,
          .onset_frame = 840,
          .held_out_before_px = 1.5,
          .held_out_after_px = 0.125,
          .evidence = {},
          .solve_ms = 33};
}

}  // namespace vergence::app
