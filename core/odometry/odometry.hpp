#pragma once
#include "core/geometry/mlesac.hpp"
#include "core/geometry/pose_refine.hpp"
#include "core/odometry/front_end.hpp"
#include "core/odometry/map.hpp"
#include "core/odometry/window.hpp"
#include "core/types/pose_sample.hpp"

namespace vergence::odometry {

/// What one frame came to.
struct FrameOutcome {
  bool posed = false;
  Transform T_left_world{};
  PoseStatus status = PoseStatus::lost;
  Reason reason = Reason::no_pose;
  int inliers = 0;
  int stereo_inliers = 0;
  double reprojection_px = 0;
  bool keyframe = false;
  bool restarted = false;    // the scene was built anew in this frame
  bool relocalised = false;  // found again in the window after being lost
  double gap_s = 0;          // time since the frame before, when it was too long to predict over
  std::array<float, kStages> stage_ms{};
};

/// Stereo odometry with a given calibration (METHOD §3): predicts, follows, poses, keeps a window of keyframes.
///
/// Frames     T_left_world; world is the left camera of the first frame posed and stays when the scene is built anew.
/// Threads    One caller. Memory: from the arena at construction. Errors: by FrameOutcome.
class Odometry {
 public:
  Odometry(const OdometryOptions& options, const RigCalibration& rig, Arena& arena, PairRunner& runner);
  [[nodiscard]] static std::size_t memory_needed(const OdometryOptions& options, const RigCalibration& rig) noexcept;

  [[nodiscard]] FrameOutcome process(const RigFrame& frame) noexcept;

 private:
  struct PoseFit {
    bool found = false;
    Transform T_left_world{};
    int inliers = 0;
    int stereo = 0;
    int across = 0;  // points found in two cameras, whether they agree or not
    int near = 0;    // inliers whose depth this frame measures
    int given = 0;   // points that were found in the images at all
    double rms_px = 0;
    bool weak = false;         // the points leave some direction of motion open
    std::uint8_t cameras = 0;  // bit k: camera k holds at least a few of the inliers
  };

  [[nodiscard]] Transform predict(double dt_s) const noexcept;
  [[nodiscard]] PoseFit track(const Transform& predicted, std::uint8_t structured, FrameOutcome* out) noexcept;
  [[nodiscard]] int points_in_view(const Transform& T_left_world) const noexcept;
  [[nodiscard]] PoseFit relocalise(FrameOutcome* out) noexcept;
  [[nodiscard]] PoseFit fit_pose(const Transform& start, bool sample) noexcept;
  void collect() noexcept;
  void settle_points(const PoseFit& fit) noexcept;
  [[nodiscard]] bool wants_keyframe() const noexcept;
  void make_keyframe(const PoseFit& fit, Stamp stamp, FrameOutcome* out) noexcept;
  [[nodiscard]] bool start_scene(const Transform& T_left_world, Stamp stamp, FrameOutcome* out) noexcept;
  /// The cameras agree about the scene: only then does a frame shape the map.
  [[nodiscard]] static bool confirmed_across(const PoseFit& fit) noexcept;
  /// What is wrong with the images themselves, `none` if nothing.
  [[nodiscard]] Reason weakness(const ImageCheck& images) const noexcept;
  void judge(const PoseFit& fit, const ImageCheck& images, FrameOutcome* out) const noexcept;
  void remember(const Transform& T_left_world, Stamp stamp) noexcept;

  const OdometryOptions& options_;
  const RigCalibration& rig_;
  FrontEnd front_end_;
  Map map_;
  WindowAdjuster window_;
  RigObservationTable table_;
  RigMlesac mlesac_;
  PoseRefiner refiner_;
  BoundedVector<std::uint16_t> owner_;  // map index of each row of the table
  Random random_;

  Transform T_left_world_{};        // of the last posed frame
  Vec3 turn_per_s_ = Vec3::Zero();  // of the last step: rotation vector and translation of T_now_before, a second
  Vec3 shift_per_s_ = Vec3::Zero();
  Stamp stamp_{};
  bool any_pose_ = false;
  int frames_lost_ = 0;        // in a row, with images that show something
  bool across_fails_ = false;  // at the last keyframe the other cameras confirmed hardly anything
  int restart_cooldown_ = 0;   // frames still marked after a restart
  int keyframe_points_ = 0;    // active points when the last keyframe was made
};

}  // namespace vergence::odometry
