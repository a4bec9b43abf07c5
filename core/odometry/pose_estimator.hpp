#pragma once
#include "core/geometry/mlesac.hpp"
#include "core/geometry/pose_refine.hpp"
#include "core/odometry/map.hpp"
#include "core/odometry/options.hpp"

namespace vergence::odometry {

/// A pose of the rig found from this frame's observations of the map, and what it rests on.
struct PoseFit {
  bool found = false;
  Transform T_left_world{};
  int inliers = 0;
  int stereo = 0;
  int stereo_found = 0;  // points found in two cameras, whether they agree or not
  int near = 0;          // inliers whose depth this frame measures
  int given = 0;         // points that were found in the images at all
  double rms_px = 0;
  std::uint8_t cameras = 0;        // bit k: camera k holds at least a few of the inliers
  Mat6 covariance = Mat6::Zero();  // of T_left_world with the points held: left perturbation (φ
                                   // rad, τ m), about the left camera
  /// The cameras agree about the scene: only then does a frame shape the map.
  [[nodiscard]] bool confirmed_stereo() const noexcept;
};

/// Poses from points: three points in MLESAC, then all of them.
///
/// Linked, the cameras are one rigid rig; unlinked, each camera's pose is found for itself and the
/// rig's transform is what comes out.
/// Ownership  Options and rig are the owner's. agrees() stays valid until the next fit. Threads:
///            one caller. Memory: the arena's.
class PoseEstimator {
 public:
  PoseEstimator(const OdometryOptions& options, const RigCalibration& rig, Arena& arena);
  [[nodiscard]] static std::size_t memory_needed() noexcept;

  /// From `start`; with `sample` by MLESAC first, else by refinement alone.
  [[nodiscard]] PoseFit fit_linked(const Map& map, const Transform& start, bool sample) noexcept;
  /// By the left camera's observations alone; the others' are judged by the pose that comes out.
  /// Not found: stated in the fit.
  [[nodiscard]] PoseFit fit_left(const Map& map, const Transform& start) noexcept;
  /// For a fit, the last one, of cameras that contradict each other: which is right the images do
  /// not say, but the left one is what the pose is of. Its own fit if that is good enough; else
  /// `all` stands, and agrees() with it.
  [[nodiscard]] PoseFit prefer_left(const Map& map, const Transform& start,
                                    const PoseFit& all) noexcept;
  /// Each camera for itself. T_camera_left (in/out, as many as cameras): prediction, then this
  /// frame's; a camera that found no pose keeps its prediction and supports nothing.
  [[nodiscard]] PoseFit fit_unlinked(const Map& map, const Transform& start, bool sample,
                                     std::span<Transform> T_camera_left) noexcept;
  /// One camera alone, for its own pose T_camera_world; false: none found.
  [[nodiscard]] bool fit_camera(const Map& map, int k, const Transform& start, bool sample,
                                Transform* T_camera_world) noexcept;

  /// Call after settle_points(). Returns true if the points that were found but do not fit the pose
  /// agree on another motion; wrong matches do not.
  [[nodiscard]] bool others_move(const Map& map, const Transform& T_left_world) noexcept;

  /// From the next fit on: whether observations that are grossly off are left out of a fit by
  /// refinement alone (as they are to begin with) or count as much as Huber's loss lets them. What
  /// sampling began with is rough: there they always count.
  void drop_gross(bool drop) noexcept { drop_gross_ = drop; }

  /// By map point: bit k set if camera k's observation agrees with the last fit, or with the one
  /// that prefer_left() let stand.
  [[nodiscard]] std::span<const std::uint8_t> agrees() const noexcept { return agrees_; }

 private:
  struct Solved {
    bool found = false;
    int inliers = 0;
    Transform T{};
    double rms_px = 0;
    Mat6 covariance = Mat6::Zero();
  };
  void collect(const Map& map) noexcept;
  /// One row of the table; false: it is full.
  bool collect_point(const Map& map, std::size_t i, std::uint8_t cameras) noexcept;
  void collect_camera(const Map& map, int k) noexcept;
  [[nodiscard]] Solved solve(const Transform& start, bool sample) noexcept;
  /// Returns true if a camera's own pose, solved from all rows of the table, can be relied on.
  [[nodiscard]] bool holds_camera(const Solved& s) const noexcept;
  [[nodiscard]] PoseRefineOptions how_to_refine(bool rough) const noexcept;
  void count(const Map& map, PoseFit* fit) const noexcept;

  const OdometryOptions& options_;
  const RigCalibration& rig_;
  RigObservationTable table_;
  RigMlesac mlesac_;
  PoseRefiner refiner_;
  BoundedVector<std::uint16_t> owner_;           // map index of each row of the table
  std::span<std::uint8_t> agrees_, agrees_all_;  // the latter while prefer_left() tries another
  Random random_;
  bool drop_gross_ = true;
};

}  // namespace vergence::odometry
