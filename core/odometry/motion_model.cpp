#include "core/odometry/motion_model.hpp"

namespace vergence::odometry {

Transform MotionModel::predict(double dt_s) const noexcept {
  return {normalised(exp_so3(turn_per_s_ * dt_s) * T_left_world_.R),
          exp_so3(turn_per_s_ * dt_s) * T_left_world_.t + shift_per_s_ * dt_s};
}

void MotionModel::update(const Transform& T_left_world, Stamp stamp) noexcept {
  const double dt = (stamp - stamp_).to_seconds();
  if (any_ && dt > 0) {
    const Transform step = T_left_world * T_left_world_.inverse();
    turn_per_s_ = log_so3(step.R) / dt;
    shift_per_s_ = step.t / dt;
  }
  assume(T_left_world, stamp);
}

void MotionModel::assume(const Transform& T_left_world, Stamp stamp) noexcept {
  T_left_world_ = T_left_world;
  stamp_ = stamp;
  any_ = true;
}

}  // namespace vergence::odometry
