#pragma once
#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence::odometry {

/// Constant-velocity prediction of the rig's pose from its last two poses. Not thread-safe.
class MotionModel {
 public:
  /// True once there is a pose; the other values are undefined before.
  [[nodiscard]] bool any() const noexcept { return any_; }
  [[nodiscard]] const Transform& T_left_world() const noexcept { return T_left_world_; }
  [[nodiscard]] Stamp stamp() const noexcept { return stamp_; }

  /// Predicts the pose `dt_s` seconds after the last one; without motion before the second pose.
  [[nodiscard]] Transform predict(double dt_s) const noexcept;
  /// Sets the next frame's measured pose; the velocity is that of the step to it.
  void update(const Transform& T_left_world, Stamp stamp) noexcept;
  /// Sets the next frame's pose as predicted or assumed; the velocity stays.
  void assume(const Transform& T_left_world, Stamp stamp) noexcept;
  /// Corrects the last pose; the velocity stays.
  void correct(const Transform& T_left_world) noexcept { T_left_world_ = T_left_world; }
  /// Scales the velocity with the world.
  void scale(double factor) noexcept { shift_per_s_ *= factor; }

 private:
  // Pose of the last posed frame.
  Transform T_left_world_{};
  // Velocity: rotation vector (rad/s) and translation (m/s) of T_now_before over the last step.
  Vec3 turn_per_s_ = Vec3::Zero(), shift_per_s_ = Vec3::Zero();
  Stamp stamp_{};
  bool any_ = false;
};

}  // namespace vergence::odometry
