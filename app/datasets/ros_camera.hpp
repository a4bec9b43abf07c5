#pragma once
#include <optional>
#include <string>

#include "app/datasets/image_file.hpp"
#include "core/types/calibration.hpp"

/// Interpretation of sensor_msgs/CameraInfo from a file or a message.
namespace vergence::app {

struct RosCamera {
  Intrinsics lens;
  /// Rectification.
  Mat3 R = Mat3::Identity();
  /// Projection of rectified images, in px and px·m.
  Mat34 P = Mat34::Zero();
};

/// Region and binning of the sensor in an image (REP 104); zeros for the full sensor.
struct RosCrop {
  std::uint32_t binning_x = 0, binning_y = 0, x = 0, y = 0, height = 0, width = 0;
};

/// Camera model by another program's name, ignoring case and punctuation: `radtan`, `plumb_bob`,
/// `radial-tangential`; `equidistant`, `fisheye`, `kannala_brandt`. A name for no distortion gives
/// the first model. Empty for other models.
[[nodiscard]] std::optional<CameraModelKind> lens_model(std::string_view word);

/// Sets model and coefficients; a rational polynomial only if it is none. Returns a phrase about
/// the problem that follows the name of the coefficients; empty on success.
[[nodiscard]] std::string set_ros_distortion(std::string_view model, std::span<const double> d,
                                             Intrinsics* lens);

/// Converts values of the whole sensor to those of the image (REP 104). `image` is its size if
/// known. Drivers that already give the image's values are recognised by a principal point near the
/// middle; the returned phrase then states the assumption.
[[nodiscard]] std::string apply_crop(const RosCrop& crop, const std::optional<ImageSize>& image,
                                     RosCamera* camera);

/// True if images need neither distortion nor rectification: the projection is that of the
/// intrinsics.
[[nodiscard]] bool is_rectified(const RosCamera& camera);

/// Sets both intrinsics, and T_right_left from the rectifications: X_right = R_rᵀ (R_l X_left +
/// (P_r[3] / fx, 0, 0)). Returns a phrase about a problem of the right camera's projection that
/// follows its name; empty on success.
[[nodiscard]] std::string set_ros_rig(const RosCamera& left, const RosCamera& right,
                                      RigCalibration* rig);

}  // namespace vergence::app
