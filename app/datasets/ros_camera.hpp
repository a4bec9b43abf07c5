#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "app/datasets/image_file.hpp"
#include "core/math/types.hpp"
#include "core/types/calibration.hpp"

/// Interpretation of sensor_msgs/CameraInfo from a file or a message.
namespace vergence::app {

struct RosCamera {
  Intrinsics lens;
  Mat3 R = Mat3::Identity();  // rectification
  Mat34 P = Mat34::Zero();    // of rectified images, px and px·m
};

/// Which part of the sensor an image shows, and how coarsely (REP 104); zeros: all of it, as it is.
struct RosCrop {
  std::uint32_t binning_x = 0, binning_y = 0, x = 0, y = 0, height = 0, width = 0;
};

/// The lens model of any program's word for it, whatever its capitals and signs: `radtan`,
/// `plumb_bob`, `radial-tangential`; `equidistant`, `fisheye`, `kannala_brandt`. A word for no
/// distortion is the first model. Nothing: another model.
[[nodiscard]] std::optional<CameraModelKind> lens_model(std::string_view word);

/// Sets model and coefficients, of a rational polynomial where it is none. Returns what is wrong, a
/// phrase that follows the name of the coefficients; empty: nothing.
[[nodiscard]] std::string set_ros_distortion(std::string_view model, std::span<const double> d,
                                             Intrinsics* lens);

/// Numbers of the whole sensor become those of the image, as REP 104 says; `image`: its size, where
/// that is known. Drivers that already gave the image's own numbers are recognised by the principal
/// point, which lies near the middle: then the returned phrase says what was taken instead.
[[nodiscard]] std::string apply_crop(const RosCrop& crop, const std::optional<ImageSize>& image,
                                     RosCamera* camera);

/// Images of this camera need no lens and no rectification: the projection is that of the lens.
[[nodiscard]] bool is_rectified(const RosCamera& camera);

/// Both lenses and T_right_left from the rectifications: X_right = R_rᵀ (R_l X_left + (P_r[3] / fx,
/// 0, 0)). Returns what is wrong with the right camera's projection, a phrase that follows its
/// name; empty: nothing.
[[nodiscard]] std::string set_ros_rig(const RosCamera& left, const RosCamera& right,
                                      RigCalibration* rig);

}  // namespace vergence::app
