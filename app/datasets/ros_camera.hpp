#pragma once
#include <span>
#include <string>
#include <string_view>

#include "core/math/types.hpp"
#include "core/types/calibration.hpp"

/// What sensor_msgs/CameraInfo means, whether it comes in a file or in a message.
namespace vergence::app {

struct RosCamera {
  Intrinsics lens;
  Mat3 R = Mat3::Identity();  // rectification
  Mat34 P = Mat34::Zero();    // of rectified images, px and px·m
};

/// Sets model and coefficients: plumb_bob, equidistant, or rational_polynomial where it is
/// plumb_bob. Returns what is wrong, a phrase that follows the name of the coefficients; empty:
/// nothing.
[[nodiscard]] std::string set_ros_distortion(std::string_view model, std::span<const double> d,
                                             Intrinsics* lens);

/// Both lenses and T_right_left from the rectifications: X_right = R_rᵀ (R_l X_left + (P_r[3] / fx,
/// 0, 0)). Returns what is wrong with the right camera's projection, a phrase that follows its
/// name; empty: nothing.
[[nodiscard]] std::string set_ros_rig(const RosCamera& left, const RosCamera& right,
                                      RigCalibration* rig);

}  // namespace vergence::app
