#pragma once
#include "core/geometry/mlesac.hpp"
#include "core/geometry/pose_refine.hpp"
#include "core/odometry/map.hpp"
#include "core/odometry/options.hpp"

namespace vergence::odometry {

/// Share of the found points that may agree with a wrong pose. The value is chosen: with a quarter,
/// KITTI 01 rotated by 0.3° of yaw has 1.08 % of segment error, with a fifth 0.84 %
/// (calibration_bench drives).
inline constexpr double kChanceShare = 0.2;
/// Minimum share of points that are seen where pose and rig expect them: in a static scene it is
/// 0.5 to 0.9, and 0.05 if the pose follows a moving object.
inline constexpr double kMinSeenAgain = 0.3;
/// Minimum share of found points that agree with the pose; below it something else moves. A half
/// loses three frames of `sand_rover` in a mirror.
inline constexpr double kRigidShare = 0.4;
/// Minimum number of inliers of a pose that only one camera's observations, or rough matches,
/// support; a few more than agree by chance.
inline constexpr int kCameraAlone = 12;

/// Pose of the rig from this frame's observations of the map, with its support.
struct PoseFit {
  bool found = false;
  Transform T_left_world{};
  int inliers = 0;
  int stereo = 0;
  /// Number of points found in two cameras, whether or not they agree.
  int stereo_found = 0;
  /// Number of inliers whose depth this frame measures.
  int near = 0;
  /// Number of points found in the images.
  int given = 0;
  double rms_px = 0;
  /// Robust scale of the residuals of linked cameras, in sigmas of their observations, ≥ 1
  /// (RefinedPose).
  double scale = 1;
  /// Bit k is set if camera k has at least a few of the inliers.
  std::uint8_t cameras = 0;
  /// Covariance of T_left_world with fixed points: left perturbation (φ rad, τ m), about the left
  /// camera.
  Mat6 covariance = Mat6::Zero();
  /// True if the cameras agree about the points; only then a frame changes the map.
  [[nodiscard]] bool confirmed_stereo() const noexcept;
};

/// Estimates poses from points: MLESAC with three points, then a refinement with all.
///
/// Linked cameras are one rigid rig. With unlinked ones each camera's pose is estimated separately,
/// which gives the rig's transform.
/// Ownership  Options and rig are the owner's. agrees() stays valid until the next fit. One caller.
///            Memory from the arena.
class PoseEstimator {
 public:
  PoseEstimator(const OdometryOptions& options, const RigCalibration& rig, Arena& arena);

  /// Fits the pose of linked cameras from `start`; with `sample` by MLESAC first, else by
  /// refinement alone.
  [[nodiscard]] PoseFit fit_linked(const Map& map, const Transform& start, bool sample) noexcept;
  /// Fits the pose by the left camera's observations alone; the others' are compared with the
  /// result.
  [[nodiscard]] PoseFit fit_left(const Map& map, const Transform& start) noexcept;
  /// Call after a fit `all` of cameras that contradict each other. Returns the fit by the left
  /// camera, to which the pose refers, if it is good enough; else `all`. agrees() matches the
  /// result.
  [[nodiscard]] PoseFit prefer_left(const Map& map, const Transform& start,
                                    const PoseFit& all) noexcept;
  /// Fits each camera's pose separately. T_camera_left (in/out, one per camera): prediction, then
  /// this frame's; a camera without a pose keeps its prediction.
  [[nodiscard]] PoseFit fit_unlinked(const Map& map, const Transform& start, bool sample,
                                     std::span<Transform> T_camera_left) noexcept;
  /// Fits the pose T_camera_world of one camera by MLESAC. Returns false if none was found.
  [[nodiscard]] bool fit_camera(const Map& map, int k, const Transform& start,
                                Transform* T_camera_world) noexcept;

  /// Call after settle_points(). Returns true if the points that do not fit the pose agree on
  /// another motion as one rigid scene, which wrong matches hardly ever do.
  [[nodiscard]] bool others_move(const Map& map, const Transform& T_left_world) noexcept;

  /// Per map point, bit k is set if camera k's observation agrees with the last fit or the one that
  /// prefer_left() returned.
  [[nodiscard]] std::span<const std::uint8_t> agrees() const noexcept { return agrees_; }

 private:
  struct Solved {
    bool found = false;
    int inliers = 0;
    Transform T{};
    double rms_px = 0, scale = 1;
    Mat6 covariance = Mat6::Zero();
  };
  /// Fills the table with the observations of every point in the cameras that `cameras_of` selects
  /// for it. `first`: number of the table's first camera.
  template <class CamerasOf>
  void collect(const Map& map, const RigCalibration& rig, int first, CamerasOf cameras_of) noexcept;
  void collect_camera(const Map& map, int k) noexcept;
  /// Refines `start` with the observations flagged in `used` (empty: all), or samples first.
  [[nodiscard]] Solved solve(const Transform& start, bool sample,
                             std::span<const std::uint8_t> used = {}) noexcept;
  /// Fits the pose of linked cameras. With `left_only`, without sampling, the other cameras'
  /// observations are only compared with the result.
  [[nodiscard]] PoseFit fit_all(const Map& map, const Transform& start, bool sample,
                                bool left_only) noexcept;
  /// Returns true if a camera's own pose, solved from all rows of the table, can be relied on.
  [[nodiscard]] bool supports_camera(const Solved& s) const noexcept;
  void count(const Map& map, PoseFit* fit) const noexcept;

  const OdometryOptions& options_;
  const RigCalibration& rig_;
  RigObservationTable table_;
  RigMlesac mlesac_;
  PoseRefiner refiner_;
  // Map index of each row of the table.
  BoundedVector<std::uint16_t> owner_;
  // agrees_all_ keeps the flags while prefer_left() tries another fit.
  std::span<std::uint8_t> agrees_, agrees_all_;
  Random random_;
};

}  // namespace vergence::odometry
