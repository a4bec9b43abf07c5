#pragma once
#include <array>
#include <optional>

#include "core/calibration/disparity_jump.hpp"
#include "core/calibration/monitor.hpp"
#include "core/calibration/pairing_evidence.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/odometry/odometry.hpp"
#include "core/types/decision_margins.hpp"

namespace vergence {

/// Assessment of the rig after one frame: the worst result of all monitors.
struct RigAssessment {
  /// The change of the camera with the most severe one.
  calibration::MonitorResult change;
  /// Number of frames that a camera's images are late; negative if early.
  int lag_frames = 0;
  /// True if a camera disagrees with the calibration for a cause not yet identified.
  bool undecided = false;
  /// True if motion shows that the images of all cameras are from the same instant.
  bool cameras_in_sync = false;
  /// Largest of all cameras; `uncertainty` is not measured here.
  DecisionMargins margins;
};

/// Monitors of one additional camera.
struct CameraMonitors {
  std::size_t k = 0;
  calibration::Monitor monitor{};
  calibration::DisparityJumpDetector jumps{};
  calibration::PairingEvidence pairing{};
  // The reference; jumps may be measured against another calibration.
  calibration::StereoPair pair{};
  // Number of frames to come whose result is at most `undecided`.
  int grace = 0;
  // True if the newest image is distorted, for example by skewed exposures.
  bool distorted = false;
  // Transform in the previous frame, with unlinked cameras.
  Transform T_camera_left_before{};
};

/// Checks in every frame that the calibration still describes the rig. Each additional camera has a
/// monitor of the distances to epipolar lines, a detector of jumps in the disparities, and a test
/// that its images are from the same instant as the left ones.
///
/// With linked cameras, update() compares a posed frame with the reference calibration. While a
/// calibration is estimated the cameras are not linked, and update_unlinked() only detects jumps.
///
///     monitor.watch(rig, solved_and_verified);  // when the map was built with it
///     // With each posed frame:
///     const RigAssessment rig = monitor.update(odometry, outcome, number, moving, verified);
///
/// Not thread-safe. Memory from the arena at construction.
class RigMonitor {
 public:
  /// `capacity`: maximum number of tracks in a frame.
  RigMonitor(const calibration::MonitorOptions& options, int cameras, std::size_t capacity,
             Arena& arena);

  /// Makes this calibration the reference. `solved_and_verified`: it was solved from images and
  /// is verified, so less scatter is expected.
  void watch(const RigCalibration& rig, bool solved_and_verified) noexcept;
  /// Sets the expected scatter between stretches of a run, in px rms over the image.
  void expect_scatter(double bias_px) noexcept {
    for (CameraMonitors& w : monitors_) w.monitor.expect_scatter(bias_px);
  }
  /// Sets the calibration that the jump detectors compare with.
  void set_jump_reference(const RigCalibration& rig) noexcept {
    for (CameraMonitors& w : monitors_) w.jumps.set_reference(calibration::stereo_pair(rig, w.k));
  }
  /// Call when a calibration is adopted; until the map is rebuilt with it only jumps are evaluated.
  void expect_map_rebuild() noexcept { map_rebuild_pending_ = true; }
  [[nodiscard]] bool map_rebuild_pending() const noexcept { return map_rebuild_pending_; }
  /// Call when the map was rebuilt with the adopted calibration, which becomes the reference.
  void map_rebuilt(const odometry::Map& map, const RigCalibration& rig,
                   bool solved_and_verified) noexcept;
  /// Call when the map was rebuilt with the same calibration: jumps are measured from its points
  /// on.
  void map_rebuilt(const odometry::Map& map) noexcept;
  /// Call when the cameras are unlinked because a calibration is estimated.
  void begin_unlinked(const RigCalibration& rig) noexcept;

  /// Assesses a posed frame of linked cameras. `moving`: the pose differs from the last one by more
  /// than its uncertainty. `verified`: state of the reference. With an
  /// unverified calibration, whose errors vary over the image, changes of the rig are `undecided`.
  [[nodiscard]] RigAssessment update(const odometry::Odometry& odometry,
                                     const odometry::FrameOutcome& outcome, std::uint64_t number,
                                     bool moving, bool verified) noexcept;
  /// Detects jumps in a posed frame of unlinked cameras. Returns the number of the first frame of
  /// the changed rig, if it has changed.
  [[nodiscard]] std::optional<std::uint64_t> update_unlinked(const odometry::Odometry& odometry,
                                                             const odometry::FrameOutcome& outcome,
                                                             std::uint64_t number) noexcept;

  /// Call when an image was repeated: a camera may be a frame late until motion shows otherwise.
  void question_pairing() noexcept {
    for (CameraMonitors& w : monitors_) w.pairing.question();
  }
  /// Clears what the monitors have measured; references and jump detectors stay.
  void reset() noexcept {
    for (CameraMonitors& w : monitors_) w.monitor.reset();
  }
  /// Call when the map was lost: the next frame is not compared with earlier ones.
  void map_lost() noexcept;

 private:
  /// Result of the camera's monitor; the caller handles jumps.
  [[nodiscard]] calibration::MonitorResult update_monitor(const odometry::Odometry& odometry,
                                                          const odometry::FrameOutcome& outcome,
                                                          std::uint64_t number, int found,
                                                          bool moving, CameraMonitors* w) noexcept;
  /// Motion of the left camera since the previous monitored frame.
  [[nodiscard]] Transform step_to(const Transform& T_left_world) noexcept;
  /// Fills `stereo_` with camera k's matches. Returns the number of active points among them.
  int collect_stereo(const odometry::Map& map, std::size_t k, int min_found) noexcept;
  /// Combines the camera's results into the assessment of the rig, which is that of the worst one.
  void add_to_assessment(const CameraMonitors& w, calibration::MonitorResult v,
                         const calibration::DisparityJump& jump, bool verified,
                         RigAssessment* rig) const noexcept;

  const calibration::MonitorOptions& options_;
  FixedVector<CameraMonitors, kMaxCameras - 1> monitors_;
  BoundedVector<calibration::StereoObservation> stereo_;
  bool solved_and_verified_ = false;
  std::optional<Transform> T_left_world_before_;
  bool map_rebuild_pending_ = false;
};

}  // namespace vergence
