#pragma once
#include <array>
#include <optional>

#include "core/calibration/disparity_jump.hpp"
#include "core/calibration/monitor.hpp"
#include "core/calibration/pairing_evidence.hpp"
#include "core/odometry/odometry.hpp"

namespace vergence {

/// Assessment of the rig after one frame: the worst result of all further cameras' monitors.
struct RigAssessment {
  calibration::MonitorResult::Kind kind = calibration::MonitorResult::Kind::quiet;
  std::uint64_t onset_frame = 0;  // of `kind`
  ChangeEvidence evidence;        // of `kind`
  int lag_frames = 0;             // that a camera's images are late; negative: early
  bool undecided = false;         // something of one camera is wrong, and it is not known what
  bool cameras_in_sync = false;   // motion shows that all cameras' images are of the same instant
};

/// Checks, frame by frame, that the calibration still describes the rig. Each further
/// camera has a monitor of the distances to epipolar lines, a detector of jumps in the disparities,
/// and a test that its images are of the same instant as the left ones.
///
/// With the cameras linked, update() compares a posed frame with the reference calibration. While a
/// calibration is estimated the cameras are not linked, and update_unlinked() looks for jumps only.
///
///     monitor.watch(rig, solved_and_verified);  // a calibration is in use, its scene is there
///     const auto verdict = monitor.update(odometry, outcome, frame);  // each posed frame
///
/// Threads one. Memory from the arena at construction. Errors: the constructor throws as Monitor's.
class RigMonitor {
 public:
  /// `capacity`: tracks of a frame.
  RigMonitor(const calibration::MonitorOptions& options, int cameras, std::size_t capacity,
             Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(const calibration::MonitorOptions& options,
                                                 int cameras, std::size_t capacity) noexcept;

  /// Makes this calibration the reference. `solved_and_verified`: it was solved from images and
  /// is verified, so less scatter is expected.
  void watch(const RigCalibration& rig, bool solved_and_verified) noexcept;
  /// Sets the scatter expected between stretches of the drive, px rms over the image.
  void expect_scatter(double bias_px) noexcept;
  /// Sets the calibration that the jump detectors compare with.
  void set_jump_reference(const RigCalibration& rig) noexcept;
  /// Call when a calibration is adopted; until map_rebuilt() only jumps count.
  void expect_rebuilt_scene() noexcept { map_reset_pending_ = true; }
  [[nodiscard]] bool map_reset_pending() const noexcept { return map_reset_pending_; }
  /// Call when the scene of the adopted calibration was made; it is the reference from here on.
  void map_rebuilt(const odometry::Map& map, const RigCalibration& rig,
                   bool solved_and_verified) noexcept;
  /// Call when the scene was made anew with the same calibration: its points are compared from here
  /// on.
  void map_renewed(const odometry::Map& map) noexcept;
  /// Call when the cameras are unlinked because a calibration is estimated.
  void begin_unlinked(const RigCalibration& rig) noexcept;

  /// Assesses a posed frame of linked cameras. `verified`: state of the reference.
  /// An unverified calibration has errors that differ from place to place; the monitor cannot tell
  /// them from a change of the rig, and the result is `undecided`.
  [[nodiscard]] RigAssessment update(const odometry::Odometry& odometry,
                                     const odometry::FrameOutcome& outcome, const RigFrame& frame,
                                     bool verified) noexcept;
  /// Looks for jumps in a posed frame of unlinked cameras. Returns the number of the first frame of
  /// the changed rig, or nothing.
  [[nodiscard]] std::optional<std::uint64_t> update_unlinked(const odometry::Odometry& odometry,
                                                             const odometry::FrameOutcome& outcome,
                                                             std::uint64_t number) noexcept;

  /// Call when an image came twice: a camera may be a frame late until motion shows otherwise.
  void question_pairing() noexcept;
  /// Clears what the monitors have measured; references and jump detectors stay.
  void reset() noexcept;
  /// Call when the scene was lost: the next frame is compared with none before it.
  void map_lost() noexcept;

 private:
  /// One further camera.
  struct Watched {
    Watched(const calibration::MonitorOptions& options, std::size_t capacity, Arena& arena)
        : monitor(options, arena), jumps(capacity, arena), pairing(capacity, arena) {}
    calibration::Monitor monitor;
    calibration::DisparityJumpDetector jumps;
    calibration::PairingEvidence pairing;
    int grace = 0;                   // frames whose result is at most `undecided`
    Transform T_camera_left_before;  // with the cameras unlinked
  };

  [[nodiscard]] Watched& camera(int k) noexcept { return *watched_[static_cast<std::size_t>(k)]; }
  void set_monitor_reference(int k, const Transform& T_camera_left,
                             const Mat6& covariance) noexcept;
  /// The verdict of camera k's monitor; a jump is left to the caller.
  [[nodiscard]] calibration::MonitorResult monitor_verdict(int k,
                                                           const odometry::Odometry& odometry,
                                                           const odometry::FrameOutcome& outcome,
                                                           const RigFrame& frame, int found,
                                                           bool moving) noexcept;
  /// Motion of the left camera since the frame watched before.
  [[nodiscard]] Transform step_to(const Transform& T_left_world) noexcept;
  /// Camera k's matches into `stereo_`; how many of them hold poses.
  int collect_stereo(const odometry::Map& map, int k, int min_found) noexcept;
  [[nodiscard]] int expected_stereo(const odometry::Odometry& odometry, int k,
                                    const Transform& T_left_world) const noexcept;

  const calibration::MonitorOptions& options_;
  const int cameras_;
  std::array<std::optional<Watched>, kMaxCameras> watched_;  // [k] of camera k ≥ 1
  BoundedVector<calibration::StereoObservation> stereo_;
  RigCalibration rig_{};  // the one watched
  bool solved_and_verified_ = false;
  std::optional<Transform> T_left_world_before_;
  Stamp stamp_before_{};  // of the frame before
  bool map_reset_pending_ = false;
};

}  // namespace vergence
