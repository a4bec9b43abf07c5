#pragma once
#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence::odometry {

/// Constant velocity: where the rig is expected, from its last two poses. A value; threads one.
class MotionModel {
 public:
  /// There is a pose; before that the others mean nothing.
  [[nodiscard]] bool any() const noexcept { return any_; }
  [[nodiscard]] const Transform& T_left_world() const noexcept { return T_left_world_; }
  [[nodiscard]] Stamp stamp() const noexcept { return stamp_; }

  /// The pose so long after the last one; at standstill before the second.
  [[nodiscard]] Transform predict(double dt_s) const noexcept;
  /// The next frame's pose, as measured: from the last one to it the rig has its speed.
  void update(const Transform& T_left_world, Stamp stamp) noexcept;
  /// The next frame's pose, as assumed: the speed stays.
  void assume(const Transform& T_left_world, Stamp stamp) noexcept;
  /// The last pose, better known; the speed stays.
  void correct(const Transform& T_left_world) noexcept { T_left_world_ = T_left_world; }
  /// The world was scaled by this factor.
  void scale(double factor) noexcept { shift_per_s_ *= factor; }

 private:
  Transform T_left_world_{};  // of the last posed frame
  // Of the last step: rotation vector and translation of T_now_before, a second.
  Vec3 turn_per_s_ = Vec3::Zero(), shift_per_s_ = Vec3::Zero();
  Stamp stamp_{};
  bool any_ = false;
};

}  // namespace vergence::odometry
