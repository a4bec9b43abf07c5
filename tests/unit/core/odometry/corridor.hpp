#pragma once

#include "core/odometry/odometry.hpp"
#include "core/types/rig_frame.hpp"
#include "tests/support/parallel_rig.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::odometry::test {

/// A rig that drives along a textured corridor, drawn ray by ray: floor, two walls, an end. Sensor
/// noise of one grey level.
/// World: x right, y down, z along the corridor; the left camera starts in its middle.
class Corridor {
 public:
  explicit Corridor(int cameras = 2)
      : images_(static_cast<std::size_t>(cameras), features::test::Image(kWidth, kHeight)) {
    rig_ = vergence::test::parallel_rig(vergence::test::pinhole(kWidth, kHeight, 280), 0, cameras);
    rig_.T_camera_left[1] = {exp_so3({0.004, -0.01, 0.006}), {-0.5, 0.01, -0.008}};
    if (cameras > 2) rig_.T_camera_left[2] = {exp_so3({-0.006, 0.004, 0.002}), {-0.2, -0.05, 0.01}};
    rig_.baseline = rig_.T_camera_left[1].t.norm();
  }
  [[nodiscard]] const RigCalibration& rig() const { return rig_; }

  /// Where the left camera is in frame i: 0.15 m further each time, weaving. Between frames, too.
  [[nodiscard]] static Transform T_world_left(double i) {
    const double a = 0.05 * i;
    return {exp_so3({0.004 * std::sin(3 * a), 0.02 * std::sin(a), 0.003 * std::cos(2 * a)}),
            {0.1 * std::sin(a), 0, 0.15 * i}};
  }
  /// From now on a textured panel drives along ahead, as far as the rig does: it hides 0.6 of the
  /// view.
  void show_panel() { panel_ = true; }

  /// Frame i seen by a rig of these transforms; the images live until the next call.
  [[nodiscard]] RigFrame frame(int i, const std::array<Transform, kMaxCameras>& T_camera_left) {
    return frame_at(i, i, T_camera_left);
  }
  /// Frame i of a drive of its own: seen from where frame `place` of the usual one is.
  [[nodiscard]] RigFrame frame_at(int i, double place,
                                  const std::array<Transform, kMaxCameras>& T_camera_left) {
    RigFrame f{.number = static_cast<std::uint64_t>(i),
               .stamp = Stamp(1'000'000'000 + 50'000'000LL * i),
               .cameras = rig_.cameras};
    for (std::size_t k = 0; k < images_.size(); ++k) {
      Random noise(static_cast<std::uint64_t>(4 * i) + k);
      const Transform T_left_camera = T_camera_left[k].inverse();
      const Transform T_world_camera = T_world_left(place) * T_left_camera;
      const Intrinsics& c = rig_.intrinsics[k];
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const Vec3 ray((x - c.cx) / c.fx, (y - c.cy) / c.fy, 1);
          double grey = noise.normal();
          if (!on_panel(T_left_camera.t, T_left_camera.R * ray, &grey))
            grey += shade(T_world_camera.t, T_world_camera.R * ray);
          images_[k].at(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
        }
      f.images[k] = images_[k].view();
    }
    return f;
  }
  [[nodiscard]] RigFrame frame(int i) { return frame(i, rig_.T_camera_left); }
  [[nodiscard]] RigFrame frame_at(int i, double place) {
    return frame_at(i, place, rig_.T_camera_left);
  }

 private:
  static constexpr int kWidth = 320, kHeight = 240;
  /// The nearest surface along a ray. Waves are 0.25 to 0.8 m long, 12 px at 6 m; at the end 0.7 to
  /// 2 m.
  [[nodiscard]] double shade(const Vec3& from, const Vec3& ray) const {
    constexpr double kWall = 3.0, kFloor = 1.5, kCeiling = -2.5, kEnd = 24.0;
    double at = 1e9;
    std::size_t surface = 0;
    const auto meet = [&](double distance, double along, std::size_t which) {
      if (along * distance <= 0 || distance / along >= at) return;
      at = distance / along;
      surface = which;
    };
    meet(kEnd - from.z(), ray.z(), 0);
    meet(kWall - from.x(), ray.x(), 1);
    meet(-kWall - from.x(), ray.x(), 2);
    meet(kFloor - from.y(), ray.y(), 3);
    meet(kCeiling - from.y(), ray.y(), 4);
    const Vec3 p = from + at * ray;
    const Vec2 on = surface == 0  ? Vec2(p.x(), p.y())
                    : surface < 3 ? Vec2(p.z(), p.y())
                                  : Vec2(p.x(), p.z());
    return textures_[surface](on);
  }
  /// The panel's grey value is added where the ray (frame: left camera) meets it.
  [[nodiscard]] bool on_panel(const Vec3& from, const Vec3& ray, double* grey) const {
    // All three are in m.
    constexpr double kDepth = 2.3, kLeft = -0.9, kRight = 0.7;
    if (!panel_ || ray.z() <= 0) return false;
    const Vec3 p = from + (kDepth - from.z()) / ray.z() * ray;
    if (p.x() < kLeft || p.x() > kRight) return false;
    *grey += panel_texture_(Vec2(p.x(), p.y()));
    return true;
  }

  RigCalibration rig_;
  bool panel_ = false;
  features::test::Texture panel_texture_{16, 0.08, 0.25};
  std::vector<features::test::Image> images_;
  std::array<features::test::Texture, 5> textures_{
      features::test::Texture(11, 0.7, 2.0), features::test::Texture(12, 0.25, 0.8),
      features::test::Texture(13, 0.25, 0.8), features::test::Texture(14, 0.25, 0.8),
      features::test::Texture(15, 0.25, 0.8)};
};

/// An odometry of a calibrated rig.
struct LinkedOdometry {
  explicit LinkedOdometry(const RigCalibration& rig, const OdometryOptions& o = {})
      : options(o), odometry(options, rig, true, arena, runner) {}
  OdometryOptions options;
  SequentialRunner runner;
  Arena arena;
  Odometry odometry;
};

}  // namespace vergence::odometry::test
