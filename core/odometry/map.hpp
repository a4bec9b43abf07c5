#pragma once
#include <array>
#include <cstdint>

#include "core/features/patch.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/types/calibration.hpp"
#include "core/types/time.hpp"

namespace vergence::odometry {

inline constexpr std::size_t kMaxWindow =
    20;  // keyframes; OdometryOptions::window_keyframes stays below
inline constexpr std::size_t kMaxPoints =
    2048;  // of the map: tracked ones and those the window still sees

inline constexpr double kNearDisparity =
    3.0;  // px between a point and infinity: ten times the noise of a match; what makes scale

// Depth given to a point whose disparity is within the noise of zero.
inline constexpr double kFarBaselines = 2000.0;

/// Observations of a point in one rig frame: pixels of an ideal pinhole camera with each camera's
/// own K, distortion removed.
struct PointObservation {
  std::array<Eigen::Vector2f, kMaxCameras> pixel{};
  std::array<float, kMaxCameras> sigma{};  // px, one coordinate
  std::uint8_t cameras = 0;                // bit k: camera k saw it

  [[nodiscard]] bool by(int k) const noexcept {
    return ((cameras >> static_cast<unsigned>(k)) & 1U) != 0;
  }
  void set(int k, const Vec2& at, float s) noexcept {
    pixel[static_cast<std::size_t>(k)] = at.cast<float>();
    sigma[static_cast<std::size_t>(k)] = s;
    cameras = static_cast<std::uint8_t>(cameras | (1U << static_cast<unsigned>(k)));
  }
  void drop(int k) noexcept {
    cameras = static_cast<std::uint8_t>(cameras & ~(1U << static_cast<unsigned>(k)));
  }
};

enum class PointStage : std::uint8_t {
  free,       // slot not in use
  candidate,  // followed, but not yet seen often enough to hold a pose
  active,     // followed, holds poses
  dormant,    // no longer followed; the window still adjusts with its observations
};

/// A point of the scene. p_world in metres; the patch is what it looked like in `left` where it was
/// made.
struct MapPoint {
  PointStage stage = PointStage::free;
  std::uint32_t id = 0;     // of the track; given again after 2^32 others
  std::uint8_t missed = 0;  // frames in a row that did not find it
  std::uint16_t found = 0;  // frames that did
  Vec3 p_world = Vec3::Zero();
  Transform T_origin_world{};             // left camera where the patch was cut
  Vec3 ray = Vec3::UnitZ();               // (x, y, 1) of its pixel there
  Mat2 d_ray_d_pixel = Mat2::Identity();  // of that ray's x, y by the raw pixel
  features::Patch patch{};
  PointObservation now{};  // this frame's
  std::uint8_t in_images =
      0;  // bit k: found in camera k's image now, whether that agrees with the pose or not
  bool across = false;          // another camera than `left` has seen it where it should be
  bool logged = false;          // at `logged_at`
  Eigen::Vector2f logged_at{};  // raw pixel in `left` when the track log last took a frame
  std::array<Eigen::Vector2f, kMaxCameras> raw{};   // this frame's pixels as the image has them
  std::array<PointObservation, kMaxWindow> seen{};  // by keyframe slot

  /// Its position is good enough to reckon poses with.
  [[nodiscard]] bool holds_poses() const noexcept {
    return stage == PointStage::active || stage == PointStage::dormant;
  }
  [[nodiscard]] bool followed() const noexcept {
    return stage == PointStage::candidate || stage == PointStage::active;
  }
};

struct Keyframe {
  Transform T_left_world{};
  std::array<Transform, kMaxCameras>
      T_camera_left{};  // as they were then; read while the cameras are not linked
  Stamp stamp{};
};

/// Points and the window of keyframes, fixed memory.
///
/// Policies when full  Points: make_point() refuses, the caller counts. Keyframes: make_keyframe()
/// drops the oldest first.
class Map {
 public:
  Map(std::size_t window, Arena& arena)
      : points_(arena.make<MapPoint>(kMaxPoints, "map points")), window_(window) {}
  [[nodiscard]] static std::size_t memory_needed() noexcept {
    return kMaxPoints * sizeof(MapPoint) + 2 * kCacheLine;
  }

  void clear() noexcept;
  /// A free slot, cleared; null when there is none.
  [[nodiscard]] MapPoint* make_point() noexcept;
  /// Where the next free slot is sought from. Given back by rewind() when all points made since
  /// are free again, these leave no trace in the order of slots, in which residuals are summed.
  [[nodiscard]] std::size_t cursor() const noexcept { return next_point_; }
  void rewind(std::size_t cursor) noexcept { next_point_ = cursor; }
  /// Slot of a new keyframe, dropping the oldest when the window is full. Every point's observation
  /// there is empty.
  [[nodiscard]] std::size_t make_keyframe(const Transform& T_left_world, Stamp stamp) noexcept;
  /// Everything grows by `factor` about a place of the world: points, keyframes and the distances
  /// of their cameras.
  void scale_about(const Vec3& centre, double factor) noexcept;
  /// Poses become T_left_world · T_old_new, and all points with them.
  void move_world(const Transform& T_old_new) noexcept;

  [[nodiscard]] std::span<MapPoint> points() noexcept { return points_; }
  [[nodiscard]] std::span<const MapPoint> points() const noexcept { return points_; }
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
  std::size_t next_point_ = 0;  // where the search for a free slot goes on
  std::uint32_t next_id_ = 1;
  std::array<Keyframe, kMaxWindow> keyframes_{};
  FixedVector<std::uint8_t, kMaxWindow> order_;
};

}  // namespace vergence::odometry
