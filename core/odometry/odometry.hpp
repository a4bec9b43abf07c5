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
  /// See PoseFit::covariance; zero if the pose is not a fit.
  Mat6 fit_covariance = Mat6::Zero();
  PoseStatus status = PoseStatus::lost;
  Reason reason = Reason::no_pose;

  int inliers = 0;
  int stereo_inliers = 0;
  double reprojection_px = 0;
  bool keyframe = false;
  FrameWorkload effort{};

  /// Time since the last pose measured from images; 0 if this one is.
  double unseen_s = 0;
  /// Motion expected over unseen_s. A predicted pose includes it; the pose of a repeated left image
  /// does not.
  Transform expected{};

  /// True if the map was rebuilt in this frame.
  bool restarted = false;
  /// True if the pose was found again in the window after being lost.
  bool relocalised = false;

  /// True if rebuild() will change to the next calibration; call it when this frame's tracks are no
  /// longer needed.
  bool relink_due = false;
  /// True if the calibration was changed in this frame.
  bool relinked = false;
  /// True if the previous calibration is in use again, because a map can be built with it but not
  /// with the last one.
  bool resumed = false;
  /// With `relinked`, the share of the map's points that fit the calibration.
  double points_kept = 0;

  /// True if rebuild() will rebuild the map from this frame after a gap.
  bool map_rebuild_due = false;
  /// True if rebuild() has rebuilt the map.
  bool map_rebuilt = false;
  /// True if the rig's transform was estimated from this frame's images alone.
  bool initialised = false;

  /// Time since the previous frame if that is a gap, else 0.
  double gap_s = 0;

  /// See ImageCheck::structured.
  std::uint8_t structured = 0;
  /// True if every camera delivered a new image with structure.
  bool images_good = false;
  /// True if the points do not move as one rigid scene, or most do not agree with the pose.
  bool moving = false;
  /// True if one camera repeated an image while another delivered a new one; the former may be an
  /// exposure late from now on.
  bool uneven = false;

  /// Factor by which the world was scaled about the left camera, to match the known baseline.
  double scale = 1;
  /// Correction T_adjusted_fitted of this frame's fitted pose by the window.
  Transform corrected{};
  std::array<float, kStages> stage_ms{};

  void expect(double since_s, const Transform& T_now_before) noexcept {
    unseen_s = since_s;
    expected = T_now_before;
  }
};

enum class Link : std::uint8_t {
  /// The cameras are one rigid rig with the calibration in use: stereo odometry.
  linked,
  /// Each camera's pose is estimated separately, and only the baseline length keeps the scale:
  /// parallel monocular.
  unlinked,
};

/// Visual odometry: predicts the pose, follows points, fits the pose and maintains a window of
/// keyframes, with linked or unlinked cameras.
///
/// With unlinked cameras, rig() is this frame's transform between them, not a calibration. A knock
/// of one camera then is an ordinary motion of that camera.
///
///     odometry::Odometry odometry(options, rig, true, arena, runner);
///     odometry::FrameOutcome out = odometry.process(frame);
///     if (out.posed) use(out.T_left_world);
///     odometry.rebuild(&out);  // when this frame's tracks are no longer needed
///
/// Frames     T_left_world; the world is the left camera of the first posed frame, also after a map
///            reset.
/// Threads    One caller. Memory from the arena at construction. Errors are reported in
///            FrameOutcome.
class Odometry {
 public:
  /// `known`: rig.T_camera_left is a calibration; if false, only intrinsics and baseline are used,
  /// and the first suitable pair initialises the cameras, unlinked. `masks`: see FrontEnd.
  Odometry(const OdometryOptions& options, const RigCalibration& rig, bool known, Arena& arena,
           PairRunner& runner, std::span<const ImageView> masks = {});

  /// Estimates the pose of one frame. If it would take longer than `budget`, work is left out in
  /// WorkBudget's order; zero means no limit. A replayed frame with a recorded workload repeats it.
  [[nodiscard]] FrameOutcome process(const RigFrame& frame, Duration budget = {}) noexcept;

  /// Changes to this calibration, with linked cameras. The next frame is still posed with the old
  /// one; its rebuild() then makes the change, and recomputes the map, or builds a new one if the
  /// cameras were not linked.
  void link(const RigCalibration& rig) noexcept;
  /// Call after process() of every frame: does what the outcome reports as due, unless a link was
  /// revoked since.
  void rebuild(FrameOutcome* out) noexcept;
  /// Unlinks the cameras from the next frame on; the map stays.
  ///
  /// The previous calibration is kept until the one in use is replaced. It is tried if a map cannot
  /// be started with the one in use (FrameOutcome::resumed).
  void unlink() noexcept;
  /// Discards the transform between the cameras: the next map of unlinked cameras begins by
  /// estimating it.
  void reset_extrinsics() noexcept;
  [[nodiscard]] Link linked() const noexcept { return link_; }

  [[nodiscard]] const RigCalibration& rig() const noexcept { return rig_; }
  [[nodiscard]] const Map& map() const noexcept { return map_; }
  [[nodiscard]] Map& map() noexcept { return map_; }
  [[nodiscard]] const FrontEnd& front_end() const noexcept { return front_end_; }
  /// True if camera k should see this point of its own frame, in m.
  [[nodiscard]] bool in_view(int k, const Vec3& p_camera) const noexcept;
  /// Per map point, bit k is set if camera k's observation in the last frame agrees with its pose.
  [[nodiscard]] std::span<const std::uint8_t> agrees() const noexcept { return poses_.agrees(); }

 private:
  [[nodiscard]] PoseFit fit(const Transform& start, bool sample) noexcept;
  [[nodiscard]] PoseFit track(const Transform& predicted, std::uint8_t structured,
                              FrameOutcome* out) noexcept;
  /// Number of points that the left camera should see, without those of `revived`, which were not
  /// found before.
  [[nodiscard]] int points_in_view(const Transform& T_left_world,
                                   const std::bitset<kMaxPoints>& revived) const noexcept;
  /// Estimates the pose from all map points, without a prediction. Dormant points are followed
  /// again and marked in *revived.
  [[nodiscard]] PoseFit relocalise(FrameOutcome* out, std::bitset<kMaxPoints>* revived) noexcept;
  /// Relocalises cameras without a pose of their own by the points' descriptors.
  void recover_cameras(const PoseFit& fit) noexcept;
  void settle_points(const PoseFit& fit) noexcept;
  /// Updates stereo_fails_.
  void count_across(const PoseFit& fit) noexcept;
  [[nodiscard]] bool needs_keyframe() const noexcept;
  void make_keyframe(Stamp stamp, FrameOutcome* out) noexcept;
  /// Creates candidate points. Returns the time it took, in ms.
  double new_points(int min_corners, FrameOutcome* out) noexcept;
  [[nodiscard]] double update_scale(std::size_t slot) noexcept;
  [[nodiscard]] bool initialise_rig(FrameOutcome* out) noexcept;
  [[nodiscard]] bool start_map(const Transform& T_left_world, Stamp stamp,
                               FrameOutcome* out) noexcept;
  void begin_map(const RigFrame& frame, const ImageCheck& images, const Transform& predicted,
                 double dt, FrameOutcome* out) noexcept;
  void adopt(const RigCalibration& rig) noexcept;
  /// Changes to a calibration and keeps the map: undistorts the window's pixels with the new
  /// intrinsics, triangulates points again, and keeps the newest pose. Returns false if this
  /// frame's matches do not fit the calibration; otherwise the frame is a keyframe with new points.
  [[nodiscard]] bool reexpress_map(const RigCalibration& rig, FrameOutcome* out) noexcept;
  /// Changes back to the previous calibration if a map can be built with it.
  [[nodiscard]] bool resume(const Transform& T_left_world, Stamp stamp, FrameOutcome* out) noexcept;
  void assess_frame(const PoseFit& fit, const ImageCheck& images, FrameOutcome* out) noexcept;

  const OdometryOptions& options_;
  RigCalibration rig_;
  Link link_;
  // True if rig_ has an initial transform.
  bool rig_known_;
  // Calibration to change to with a later pose.
  std::optional<RigCalibration> next_rig_;
  // Calibration in use before this one, or before unlink().
  std::optional<RigCalibration> last_rig_;
  FrontEnd front_end_;
  Map map_;
  WindowAdjuster window_;
  WorkBudget budget_;
  PoseEstimator poses_;
  RigInitialiser initialiser_;
  MotionModel motion_;
  GapDetector gaps_;
  NewPointMonitor new_points_;
  // True if outliers of this frame agree on another motion.
  bool others_move_ = false;

  // Number of consecutive frames without a pose but with structure.
  int frames_lost_ = 0;
  // True if the additional cameras find hardly any of their points where expected.
  bool stereo_fails_ = false;
  // True if the candidates are a trial that belongs to no keyframe.
  bool trial_ = false;
  // Number of frames since new points were tried.
  int frames_untried_ = 0;
  // Number of active points when the last keyframe was made.
  int keyframe_points_ = 0;
};

}  // namespace vergence::odometry
