#pragma once
#include <array>
#include <cstdint>

#include "core/features/patch.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/types/calibration.hpp"
#include "core/types/time.hpp"

namespace vergence::odometry {

/// Maximum number of keyframes in the window.
inline constexpr std::size_t kMaxWindow = 20;
/// Maximum number of points in the map: tracked ones and those that the window still observes.
inline constexpr std::size_t kMaxPoints = 2048;

/// Maximum number of consecutive frames for which one point may be hidden, or all points lost.
inline constexpr int kMissesAllowed = 2;
/// Minimum number of frames in which a point was found before it constrains poses or tests the
/// rig: a new point's match was searched for in the band of the calibration in use.
inline constexpr std::uint16_t kMinFound = 2;

/// Minimum disparity of a near point relative to infinity, in px: ten times the noise of a match.
/// Near points determine the scale.
inline constexpr double kNearDisparity = 3.0;

// Depth in baselines of a point whose disparity is within the noise of zero.
inline constexpr double kFarBaselines = 2000.0;

/// Sets of cameras: bit k stands for camera k.
[[nodiscard]] inline bool has_camera(std::uint8_t set, int k) noexcept {
  return ((set >> static_cast<unsigned>(k)) & 1U) != 0;
}
inline void add_camera(std::uint8_t* set, int k) noexcept {
  *set = static_cast<std::uint8_t>(*set | (1U << static_cast<unsigned>(k)));
}

/// Observations of a point in one rig frame: pixels of an ideal pinhole camera with each camera's
/// own K, distortion removed.
struct PointObservation {
  std::array<Eigen::Vector2f, kMaxCameras> pixel{};
  /// Standard deviation of one coordinate, in pixels.
  std::array<float, kMaxCameras> sigma{};
  /// Bit k is set if camera k saw the point.
  std::uint8_t cameras = 0;

  [[nodiscard]] bool by(int k) const noexcept { return has_camera(cameras, k); }
  void set(int k, const Vec2& at, float s) noexcept {
    pixel[static_cast<std::size_t>(k)] = at.cast<float>();
    sigma[static_cast<std::size_t>(k)] = s;
    add_camera(&cameras, k);
  }
  void drop(int k) noexcept {
    cameras = static_cast<std::uint8_t>(cameras & ~(1U << static_cast<unsigned>(k)));
  }
};

enum class PointStage : std::uint8_t {
  free,
  /// The point is followed, but was not yet found often enough to constrain poses.
  candidate,
  /// The point is followed and constrains poses.
  active,
  /// The point is no longer followed; the window still uses its observations.
  dormant,
};

/// A point of the map, with its position in metres and the patch that it showed in `left` when it
/// was created.
struct MapPoint {
  PointStage stage = PointStage::free;
  /// Number of the track; reused after 2^32 others.
  std::uint32_t id = 0;
  /// Number of consecutive frames in which the point was not found.
  std::uint8_t missed = 0;
  /// Number of frames in which the point was found.
  std::uint16_t found = 0;
  Vec3 p_world = Vec3::Zero();

  /// Pose of the left camera in which the patch was cut.
  Transform T_origin_world{};
  /// Ray (x, y, 1) of its pixel there.
  Vec3 ray = Vec3::UnitZ();
  /// Derivative of that ray's x and y with respect to the raw pixel.
  Mat2 d_ray_d_pixel = Mat2::Identity();

  /// Observations in the current frame that agree with the pose.
  PointObservation now{};
  /// Bit k is set if the point was found in camera k's current image, whether or not it agrees.
  std::uint8_t in_images = 0;
  /// True if an additional camera has seen the point where expected.
  bool across = false;

  /// True if the track log has taken the point, at `logged_at`.
  bool logged = false;
  /// Raw pixel in `left` when it was last logged.
  Eigen::Vector2f logged_at{};
  std::array<Eigen::Vector2f, kMaxCameras> raw{};
  std::array<PointObservation, kMaxWindow> seen{};
  features::Patch patch{};

  /// True if the position is accurate enough to constrain poses.
  [[nodiscard]] bool constrains_poses() const noexcept {
    return stage == PointStage::active || stage == PointStage::dormant;
  }
  [[nodiscard]] bool followed() const noexcept {
    return stage == PointStage::candidate || stage == PointStage::active;
  }
};

struct Keyframe {
  Transform T_left_world{};
  /// Transforms at that time; used while the cameras are not linked.
  std::array<Transform, kMaxCameras> T_camera_left{};
  Stamp stamp{};
};

/// Points and the window of keyframes in fixed memory. If full, make_point() returns null and
/// make_keyframe() drops the oldest keyframe.
class Map {
 public:
  Map(std::size_t window, Arena& arena)
      : points_(arena.make<MapPoint>(kMaxPoints, "map points")), window_(window) {}

  void clear() noexcept;
  /// Returns a cleared free slot, or null if there is none.
  [[nodiscard]] MapPoint* make_point() noexcept;
  /// Call before a frame's points are made, which then take the first free slots: few slots are in
  /// use and stay in the cache, and points that were only tried do not change the order of later
  /// ones.
  void reuse_slots() noexcept { next_point_ = 0; }
  /// Returns the slot of a new keyframe without observations; drops the oldest one if the window is
  /// full.
  [[nodiscard]] std::size_t make_keyframe(const Keyframe& keyframe) noexcept;
  /// Stores the followed points' current observations in a keyframe. Returns the number of points
  /// that the left camera saw.
  int observe(std::size_t slot) noexcept;
  /// Scales points, keyframes and baselines by `factor` about a point of the world.
  void scale_about(const Vec3& centre, double factor) noexcept;
  /// Changes the world frame: poses become T_left_world · T_old_new, and points follow.
  void move_world(const Transform& T_old_new) noexcept;

  /// All slots up to the last one in use; some of them are free.
  [[nodiscard]] std::span<MapPoint> points() noexcept { return points_.first(used_); }
  [[nodiscard]] std::span<const MapPoint> points() const noexcept { return points_.first(used_); }
  [[nodiscard]] Keyframe& keyframe(std::size_t slot) noexcept { return keyframes_[slot]; }
  [[nodiscard]] const Keyframe& keyframe(std::size_t slot) const noexcept {
    return keyframes_[slot];
  }
  /// Slots in use, oldest first.
  [[nodiscard]] std::span<const std::uint8_t> order() const noexcept { return order_.span(); }

 private:
  void drop_oldest_keyframe() noexcept;

  std::span<MapPoint> points_;
  std::size_t window_;
  // Start of the search for a free slot.
  std::size_t next_point_ = 0;
  // One more than the last slot in use.
  std::size_t used_ = 0;
  std::uint32_t next_id_ = 1;
  std::array<Keyframe, kMaxWindow> keyframes_{};
  FixedVector<std::uint8_t, kMaxWindow> order_;
};

}  // namespace vergence::odometry
