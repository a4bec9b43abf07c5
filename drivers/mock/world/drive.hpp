#pragma once
#include <cstdint>
#include <vector>

#include "core/math/se3.hpp"
#include "core/types/time.hpp"
#include "drivers/mock/world/kinds.hpp"
#include "drivers/mock/world/world.hpp"

namespace vergence::mock {

struct DriveOptions {
  DriveKind kind = DriveKind::loop;
  /// Seed of the disturbances by suspension and driver.
  std::uint64_t seed = 1;
  /// Speed on straights in m/s, 0.01 to 20.
  double speed = 12.0;
  /// Acceleration in m/s², 0.3 to 4; braking is 1.3 times that.
  double acceleration = 1.4;
  /// Lateral acceleration in corners in m/s², 0.5 to 5.
  double lateral = 2.6;
  /// Gain on pitch, roll and heave of the springs, 0 (rigid) to 3.
  double suspension = 1.0;
  /// Gain on the vibration at 6–12 Hz, 0 (none) to 5.
  double vibration = 1.0;
  /// Length of each stop in s, 1 to 3600. The standing start and end last as long, at most a
  /// minute.
  double stop_s = 3.0;
};

/// State of the vehicle at an instant. Body axes are forward, left, up, with the origin on the
/// ground under the roof rack. p_enu = T_enu_body · p_body.
struct BodyState {
  Transform T_enu_body;
  /// Velocity of the body's origin in enu, in m/s.
  Vec3 velocity = Vec3::Zero();
  /// Acceleration of the body's origin in enu, in m/s², without gravity.
  Vec3 acceleration = Vec3::Zero();
  /// Angular rate in body axes, in rad/s: dR/dt = R [ω]×.
  Vec3 angular_rate = Vec3::Zero();
};

/// True trajectory of the vehicle, the ground truth of a mock session.
///
/// Method     Position and attitude angles are uniform quintic B-splines (C⁴) over control points
///            every kDriveStep, derived from a path of lines and arcs, a speed profile with limited
///            acceleration, the ground's height and a sprung body's disturbances. The spline is the
///            truth: sampled and differentiated exactly.
/// Time       Since the start of the drive; the vehicle stands before and after it.
/// Threads    Constant after construction.
/// Errors     The constructor throws std::invalid_argument naming the option out of range.
class Drive {
 public:
  Drive(const DriveOptions& options, const World& world);

  [[nodiscard]] BodyState at(Duration time) const noexcept;
  [[nodiscard]] Duration duration() const noexcept;
  /// Length of the path in m.
  [[nodiscard]] double length() const noexcept { return length_; }
  [[nodiscard]] const DriveOptions& options() const noexcept { return options_; }

 private:
  // Position x y z in m, then yaw, pitch (nose up) and roll (left side up) in rad.
  using Control = Eigen::Matrix<double, 6, 1>;
  DriveOptions options_;
  std::vector<Control> control_;
  double length_ = 0;
};

/// Interval of control points, fine enough for motion of up to 12 Hz.
inline constexpr Duration kDriveStep = Duration::milliseconds(20);

/// Transform of a camera at `position_body` (m) that looks forward, tilted down by `tilt_down`
/// (rad). p_body = T · p_camera.
[[nodiscard]] Transform camera_mount(const Vec3& position_body, double tilt_down) noexcept;

/// T_body_left of the default rack: 1.7 m above ground, level.
[[nodiscard]] inline Transform default_T_body_left() noexcept {
  return camera_mount({1.2, 0.375, 1.7}, 0.0);
}

/// Pose for the renderer, p_camera = T_camera_enu · p_enu, from the pose of the body and the
/// camera's mount.
[[nodiscard]] inline Transform camera_pose(const BodyState& body,
                                           const Transform& T_body_camera) noexcept {
  return (body.T_enu_body * T_body_camera).inverse();
}

}  // namespace vergence::mock
