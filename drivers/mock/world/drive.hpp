#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/math/se3.hpp"
#include "core/types/time.hpp"
#include "drivers/mock/world/kinds.hpp"
#include "drivers/mock/world/world.hpp"

namespace vergence::mock {

struct DriveOptions {
  DriveKind kind = DriveKind::loop;
  std::uint64_t seed = 1;     // of the suspension's and the driver's disturbances
  double speed = 12.0;        // m/s, on the straights; 0.01..20
  double acceleration = 1.4;  // m/s², speeding up; braking is 1.3 times that; 0.3..4
  double lateral = 2.6;       // m/s², in corners; 0.5..5
  double suspension = 1.0;    // gain on pitch, roll and heave of the springs; 0: rigid; up to 3
  double vibration = 1.0;     // gain on the shake at 6–12 Hz; 0: none; up to 5
  double stop_s = 3.0;  // s, length of each stop of the path; 1..3600. The standing start and end
                        // are as long, a minute at most
};

/// The vehicle at an instant.
///
/// Body  forward, left, up; origin on the ground under the roof rack. p_enu = T_enu_body · p_body.
struct BodyState {
  Transform T_enu_body;
  Vec3 velocity = Vec3::Zero();      // m/s, of the body's origin, in enu
  Vec3 acceleration = Vec3::Zero();  // m/s², the same, without gravity
  Vec3 angular_rate = Vec3::Zero();  // rad/s, in body axes: dR/dt = R [ω]×
};

/// Where the vehicle truly is at any time: the measure of everything in a mock session.
///
/// Method     Position and attitude angles are uniform quintic B-splines (C⁴) over control points
///            every kDriveStep, which come from a path of lines and arcs, a speed profile with
///            limited acceleration, the ground's height and a sprung body's disturbances. The
///            spline is the truth: sampled exactly, differentiated exactly.
/// Time       Since the drive's start. Before it and after its end the vehicle stands.
/// Threads    Const after construction.
/// Errors     The constructor throws std::invalid_argument naming the option out of range. at()
///            cannot fail.
class Drive {
 public:
  Drive(const DriveOptions& options, const World& world);

  [[nodiscard]] BodyState at(Duration time) const noexcept;
  [[nodiscard]] Duration duration() const noexcept;
  [[nodiscard]] double length() const noexcept { return length_; }  // m of path
  [[nodiscard]] const DriveOptions& options() const noexcept { return options_; }

 private:
  using Control =
      Eigen::Matrix<double, 6, 1>;  // x y z (m), yaw, pitch (nose up), roll (left side up), rad
  DriveOptions options_;
  std::vector<Control> control_;
  double length_ = 0;
};

inline constexpr Duration kDriveStep =
    Duration::milliseconds(20);  // between control points: holds what moves up to 12 Hz

/// Camera on the vehicle: at `position_body` (m), looking forward, tilted down by `tilt_down`
/// (rad). p_body = T · p_camera.
[[nodiscard]] Transform camera_mount(const Vec3& position_body, double tilt_down) noexcept;

/// T_body_left of the default rack: 1.7 m above the ground, level.
[[nodiscard]] inline Transform default_T_body_left() noexcept {
  return camera_mount({1.2, 0.375, 1.7}, 0.0);
}

/// Input of the renderer: p_camera = T_camera_enu · p_enu, from where the body is and where the
/// camera sits on it.
[[nodiscard]] inline Transform camera_pose(const BodyState& body,
                                           const Transform& T_body_camera) noexcept {
  return (body.T_enu_body * T_body_camera).inverse();
}

}  // namespace vergence::mock
