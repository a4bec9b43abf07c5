#pragma once
#include <vector>

#include "core/geometry/observations.hpp"
#include "core/math/random.hpp"
#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence::test {

/// A change of the true T_right_left: R ← Exp(φ) R, t ← t + τ, growing from nothing at `frame` to
/// the whole `over` frames later.
struct RigChange {
  // First frame with the change.
  std::uint64_t frame = 0;
  // Rotation φ in rad.
  Vec3 rotation = Vec3::Zero();
  // Translation τ in m.
  Vec3 translation = Vec3::Zero();
  // Number of frames over which the change grows; 0 for a knock.
  std::uint64_t over = 0;
};

/// From `frame` on the right camera exposes `frames` frames late (negative: the left one does); −1
/// … 1.
struct LagChange {
  std::uint64_t frame = 0;
  double frames = 0;
};

struct FeatureDriveOptions {
  // Size of the images in px.
  int width = 1024, height = 768;
  // True intrinsics; a test of wrong intrinsics computes with others.
  Pinhole left{1247, 1247, 511.5, 383.5};
  Pinhole right{1247, 1247, 511.5, 383.5};
  // True transform before any change.
  Transform T_right_left{exp_so3({5e-3, -8e-3, 3e-3}), {-0.75, 0, 0}};
  // Frame rate in Hz.
  double rate = 30;
  // Number of tracks in every frame, seen by both cameras.
  int tracks = 300;
  // Life of a track in frames.
  int shortest_life = 5, longest_life = 20;
  // Speed when driving, in m/s.
  double speed = 8;
  // Duration of each stretch of driving and of each stop; 0 never stops.
  double drive_s = 0, stop_s = 0;
  // Factor of the rocking: pitch ±0.3°, roll ±0.35°, heave ±15 mm, heading ±1.7°/s.
  double rocking = 1;
  // Noise of each coordinate in px: per frame, per track, and as a random walk per frame.
  double white_px = 0.3, constant_px = 0.3, walk_px = 0.1;
  // Sigma that a track states.
  double sigma_px = 0.5;
  // Share of tracks that are 3 to 30 px off in the right image.
  double outliers = 0.05;
  // Share of tracks on moving objects of up to 10 m/s.
  double movers = 0.03;
  // Smooth error field in the right image: rms of a coordinate and time constant.
  double bias_px = 0.02, bias_s = 10;
  std::vector<RigChange> changes{};
  std::vector<LagChange> lags{};
  std::uint64_t seed = 1;
};

/// One point in the two images of a frame, as a tracker with the lens model taken out would give
/// it.
struct FeatureTrack {
  std::uint32_t id = 0;
  // Ideal pixels.
  Vec2 left, right;
  // Bit 0 is the left camera, bit 1 the right one.
  std::uint8_t seen = 3;
  double sigma_px = 0;
  // True position in m.
  Vec3 p_world = Vec3::Zero();
  // True for an outlier or a moving object.
  bool wrong = false;
};

/// A drive along a street without images: plane of the road, facades, parked cars, backdrop; tracks
/// with the errors of real ones. The street runs along +z of the world, y down, the road at y = 0,
/// the camera 1.7 m above it.
/// Deterministic: the same options, the same tracks on every platform.
class FeatureDrive {
 public:
  explicit FeatureDrive(const FeatureDriveOptions& options);

  /// The next frame, for ever. Frames are numbered from 0; before the first call nothing is valid.
  void next();

  [[nodiscard]] std::uint64_t frame() const noexcept { return frame_; }
  [[nodiscard]] Stamp stamp() const noexcept;
  // Valid until the next call.
  [[nodiscard]] std::span<const FeatureTrack> tracks() const noexcept { return tracks_; }
  // True pose when the left camera exposed.
  [[nodiscard]] const Transform& T_left_world() const noexcept { return T_left_world_; }
  // True motion of the left camera.
  [[nodiscard]] const Transform& T_now_previous() const noexcept { return T_now_previous_; }
  // True transform of this frame.
  [[nodiscard]] const Transform& T_right_left() const noexcept { return T_right_left_; }
  // Speed in m/s.
  [[nodiscard]] double speed() const noexcept { return speed_; }
  [[nodiscard]] const FeatureDriveOptions& options() const noexcept { return options_; }

 private:
  struct Point {
    std::uint32_t id = 0;
    // Remaining frames.
    int life = 0;
    Vec3 p_world = Vec3::Zero();
    // Motion per frame in m.
    Vec3 velocity = Vec3::Zero();
    // Offset of an outlier in the right image, in px.
    Vec2 offset = Vec2::Zero();
    // Errors of the coordinates in px.
    std::array<double, 4> constant{}, walked{};
    bool wrong = false;
  };
  using Field = std::array<double, 6>;

  void move();
  void wander();
  [[nodiscard]] Transform pose_at(double frames_ago) const noexcept;
  [[nodiscard]] bool project(const Vec3& p_world, Vec2* left, Vec2* right) const noexcept;
  [[nodiscard]] bool sight(Point* p, FeatureTrack* track);
  [[nodiscard]] bool new_point(Point* p);
  [[nodiscard]] bool hit(const Vec3& origin, const Vec3& ray, Vec3* p) const noexcept;
  [[nodiscard]] Vec2 bias_at(const Vec2& right) const noexcept;

  FeatureDriveOptions options_;
  Random random_;
  std::uint64_t frame_ = 0;
  bool started_ = false;
  std::uint32_t next_id_ = 1;
  // Speed in m/s, and times in the cycle of driving and of rocking in s.
  double speed_ = 0, phase_s_ = 0, rocked_s_ = 0;
  // Position of the left camera in m.
  double x_ = 0, z_ = 0;
  std::array<double, 8> phases_{};
  // T_left_world by the vehicle's clock, now and one frame ago.
  std::array<Transform, 2> poses_{};
  Transform T_left_world_, T_right_world_, T_now_previous_, T_right_left_;
  std::array<Field, 2> field_{};
  std::vector<Point> points_;
  std::vector<FeatureTrack> tracks_;
};

}  // namespace vergence::test
