#pragma once
#include <bitset>
#include <optional>

#include "core/odometry/front_end.hpp"
#include "core/odometry/gap_detector.hpp"
#include "core/odometry/map.hpp"
#include "core/odometry/motion_model.hpp"
#include "core/odometry/new_point_monitor.hpp"
#include "core/odometry/pose_estimator.hpp"
#include "core/odometry/rig_initialiser.hpp"
#include "core/odometry/window.hpp"
#include "core/odometry/work_budget.hpp"
#include "core/types/pose_sample.hpp"

namespace vergence::odometry {

/// Result of one frame.
struct FrameOutcome {
  bool posed = false;
  Transform T_left_world{};
  Mat6 fit_covariance = Mat6::Zero();  // as PoseFit::covariance; zero: the pose is not a fit
  PoseStatus status = PoseStatus::lost;
  Reason reason = Reason::no_pose;
  int inliers = 0;
  int stereo_inliers = 0;
  double reprojection_px = 0;
  bool keyframe = false;
  FrameWorkload effort{};    // what was done of the work beside the pose
  double unseen_s = 0;       // since the last pose that images have shown; 0: this one
  Transform expected{};      // the motion since then that is expected: the pose is predicted by it,
                             // or, of a left image that came twice, is without it
  bool restarted = false;    // the scene was rebuilt in this frame
  bool relocalised = false;  // found again in the window after being lost
  bool relink_due = false;   // rebuild() will change to the next calibration; call it when this
                             // frame's tracks are no longer needed
  bool relinked = false;     // rebuild() has changed to it in this frame
  bool resumed = false;    // the one in use before the last was: a scene can be made by it, and not
                           // by the last
  double points_kept = 0;  // with `relinked`: share of the scene's points that fit the calibration
  bool renewal_due = false;     // after a gap rebuild() makes the scene anew from this frame
  bool renewed = false;         // rebuild() has made it anew
  bool initialised = false;     // the rig's transform was found from this frame's images alone
  double gap_s = 0;             // time since the frame before if it was a gap, else 0
  std::uint8_t structured = 0;  // bit k: camera k gave an image that shows something new
  bool images_good = false;     // every camera gave an image, new and with structure
  bool moving =
      false;  // the points seen do not move as one rigid scene, or most do not agree with the pose
  bool uneven = false;  // a camera gave an older image again and another a new one: from here on
                        // the one may be an exposure behind
  double scale =
      1;  // everything of the world was scaled by this about the left camera, to the known baseline
  Transform corrected{};  // T_adjusted_fitted: what the window moved this frame's fitted pose by
  std::array<float, kStages> stage_ms{};

  void expect(double since_s, const Transform& T_now_before) noexcept {
    unseen_s = since_s;
    expected = T_now_before;
  }
};

/// Relation between the cameras' poses.
enum class Link : std::uint8_t {
  linked,    // one rigid rig with the calibration in use: stereo odometry
  unlinked,  // each camera's pose is found for itself; the baseline's length alone keeps the scale:
             // parallel monocular
};

/// Visual odometry: predicts, follows, poses, keeps a window of keyframes; linked or
/// not.
///
/// Unlinked, rig() is this frame's transform between the cameras and no calibration. A knock of one
/// camera is a motion of that camera like any other there.
///
///     odometry::Odometry odometry(options, rig, true, arena, runner);
///     odometry::FrameOutcome out = odometry.process(frame);
///     if (out.posed) use(out.T_left_world);
///     odometry.rebuild(&out);  // when this frame's tracks are of no more use
///
/// Frames     T_left_world; world is the left camera of the first frame posed and stays when the
///            scene is rebuilt.
/// Threads    One caller. Memory: from the arena at construction. Errors: by FrameOutcome.
class Odometry {
 public:
  /// `known`: rig.T_camera_left is a calibration. False: of the rig only intrinsics and baseline
  /// are read; the first pair that allows it initialises the cameras, unlinked. `masks` as
  /// FrontEnd's.
  Odometry(const OdometryOptions& options, const RigCalibration& rig, bool known, Arena& arena,
           PairRunner& runner, std::span<const ImageView> masks = {});
  [[nodiscard]] static std::size_t memory_needed(const OdometryOptions& options,
                                                 const RigCalibration& rig,
                                                 std::span<const ImageView> masks = {}) noexcept;

  /// Estimates the pose of one frame. If it would take longer than `budget`, work is left out in
  /// WorkBudget's order; zero is no limit. A replayed frame that states how much work was done gets
  /// as much again.
  [[nodiscard]] FrameOutcome process(const RigFrame& frame, Duration budget = {}) noexcept;

  /// Changes to this calibration, with linked cameras. The next frame is still posed with the old
  /// one; its rebuild() then makes the change. If the cameras were linked the scene is kept and
  /// recomputed with the new calibration; if not, a new scene is made from that frame where
  /// possible.
  void link(const RigCalibration& rig) noexcept;
  /// Call after process() of every frame: does what the outcome reports as due, unless a link was
  /// revoked since.
  void rebuild(FrameOutcome* out) noexcept;
  /// Unlinks the cameras from the next frame on; the scene stays.
  ///
  /// The previous calibration is kept until the one in use is replaced. It is tried when a scene
  /// has to be started and cannot be with the one in use (FrameOutcome::resumed).
  void unlink() noexcept;
  /// Discards the transform between the cameras: the next scene of unlinked cameras begins with
  /// estimating it.
  void reset_extrinsics() noexcept;
  [[nodiscard]] Link linked() const noexcept { return link_; }
  /// Sets whether, from the next frame on, gross residuals are treated as wrong points and left out
  /// of fits (initially true). Set it to false while the calibration is unverified, when they may
  /// be its own error.
  void trust_rig(bool trusted) noexcept { poses_.drop_gross(trusted); }

  [[nodiscard]] const RigCalibration& rig() const noexcept { return rig_; }
  [[nodiscard]] const Map& map() const noexcept { return map_; }
  [[nodiscard]] Map& map() noexcept { return map_; }
  [[nodiscard]] const FrontEnd& front_end() const noexcept { return front_end_; }
  /// For each map point, bit k is set if camera k's observation in the last frame agrees with its
  /// pose.
  [[nodiscard]] std::span<const std::uint8_t> agrees() const noexcept { return poses_.agrees(); }

 private:
  [[nodiscard]] PoseFit fit(const Transform& start, bool sample) noexcept;
  [[nodiscard]] PoseFit track(const Transform& predicted, std::uint8_t structured,
                              FrameOutcome* out) noexcept;
  [[nodiscard]] int points_in_view(const Transform& T_left_world) const noexcept;
  /// Searches the pose among all map points. Points long out of sight are followed again and marked
  /// in *revived.
  [[nodiscard]] PoseFit relocalise(FrameOutcome* out, std::bitset<kMaxPoints>* revived) noexcept;
  /// Relocalises cameras whose own pose was not found by the points' descriptors.
  void recover_cameras(const PoseFit& fit) noexcept;
  void settle_points(const PoseFit& fit) noexcept;
  /// Updates stereo_fails_: whether further cameras still see the points that they have seen
  /// before.
  void count_across(const PoseFit& fit) noexcept;
  [[nodiscard]] bool wants_keyframe() const noexcept;
  void make_keyframe(Stamp stamp, FrameOutcome* out) noexcept;
  /// Makes candidate points. Returns the time it took, ms.
  double new_points(int min_corners, FrameOutcome* out) noexcept;
  [[nodiscard]] double renew_scale(std::size_t slot) noexcept;
  [[nodiscard]] bool initialise_rig(FrameOutcome* out) noexcept;
  [[nodiscard]] bool start_scene(const Transform& T_left_world, Stamp stamp,
                                 FrameOutcome* out) noexcept;
  void begin_scene(const RigFrame& frame, const ImageCheck& images, const Transform& predicted,
                   double dt, FrameOutcome* out) noexcept;
  /// Makes the scene anew from the newest frame at its pose. Returns false if that fails; the old
  /// scene is kept.
  bool renew_scene(FrameOutcome* out) noexcept;
  void adopt(const RigCalibration& rig) noexcept;
  /// Changes to a calibration and keeps the scene: the window's pixels are undistorted with the new
  /// lenses, points are triangulated again, and the newest pose stays. Returns false if this
  /// frame's matches do not fit the calibration.
  [[nodiscard]] bool reexpress_scene(const RigCalibration& rig, double* points_kept) noexcept;
  /// Changes back to the previous calibration if this frame gives a scene with it.
  [[nodiscard]] bool resume(const Transform& T_left_world, Stamp stamp, FrameOutcome* out) noexcept;
  /// Discards the scene; without a calibration the rig has to be initialised again.
  void lose_scene() noexcept;
  void assess_frame(const PoseFit& fit, const ImageCheck& images, FrameOutcome* out) noexcept;

  const OdometryOptions& options_;
  RigCalibration rig_;
  Link link_;
  bool rig_known_;                          // rig_ has a transform to begin with
  std::optional<RigCalibration> next_rig_;  // taken up with a pose to come
  std::optional<RigCalibration> last_rig_;  // in use before this one, or before unlink()
  FrontEnd front_end_;
  Map map_;
  WindowAdjuster window_;
  WorkBudget budget_;
  PoseEstimator poses_;
  RigInitialiser initialiser_;
  MotionModel motion_;
  GapDetector gaps_;
  NewPointMonitor new_points_;
  bool others_move_ = false;  // in this frame

  int frames_lost_ = 0;        // in a row, with images that show something
  bool stereo_fails_ = false;  // hardly any of the points that the other cameras saw before are
                               // where they should be in this frame
  // There are candidates, made to be tried, that belong to no keyframe; where they begin.
  std::optional<std::size_t> cursor_before_trial_;
  int frames_untried_ = 0;   // since new points were tried
  int keyframe_points_ = 0;  // active points when the last keyframe was made
};

}  // namespace vergence::odometry
