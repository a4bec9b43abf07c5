#include <array>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "app/datasets/ros_camera.hpp"
#include "app/foreign_calibration/foreign_formats.hpp"
#include "app/foreign_calibration/yaml_matrix.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

struct CameraInfo : RosCamera {
  std::string name;
};

Intrinsics read_lens(const YamlFile& file) {
  const YAML::Node& root = file.root();
  Intrinsics lens;
  lens.width = read_side(file, need(file, root, "image_width", "image_width"), "image_width");
  lens.height = read_side(file, need(file, root, "image_height", "image_height"), "image_height");
  const YAML::Node matrix = need(file, root, "camera_matrix", "camera_matrix");
  const auto K = read_matrix(file, matrix, "camera_matrix", 3, 3);
  if (K[1] != 0 || K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1)
    file.fail(matrix, "camera_matrix is not [fx 0 cx; 0 fy cy; 0 0 1]");
  lens.fx = K[0], lens.fy = K[4], lens.cx = K[2], lens.cy = K[5];
  const YAML::Node model = need(file, root, "distortion_model", "distortion_model");
  const std::string word = file.text(model, "distortion_model");
  const YAML::Node node = need(file, root, "distortion_coefficients", "distortion_coefficients");
  if (word != "equidistant" && word != "plumb_bob" && word != "rational_polynomial")
    file.fail(
        model,
        fmt::format(
            "distortion_model is \"{}\"; plumb_bob, equidistant and rational_polynomial are known",
            word.substr(0, 60)));
  const bool equidistant = word == "equidistant";
  const auto d =
      read_vector(file, node, "distortion_coefficients", equidistant ? 4 : 0, equidistant ? 4 : 8);
  if (const std::string fault = set_ros_distortion(word, d, &lens); !fault.empty())
    file.fail(node, "distortion_coefficients " + fault);
  return lens;
}

CameraInfo read_info(const YamlFile& file) {
  CameraInfo info;
  info.lens = read_lens(file);
  const YAML::Node& root = file.root();
  if (const YAML::Node name = root["camera_name"]) info.name = file.text(name, "camera_name");
  const YAML::Node rectification = need(file, root, "rectification_matrix", "rectification_matrix");
  const auto r = read_matrix(file, rectification, "rectification_matrix", 3, 3);
  info.R << r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8];
  if ((info.R.transpose() * info.R - Mat3::Identity()).cwiseAbs().maxCoeff() > 1e-3)
    file.fail(rectification, "rectification_matrix is not a rotation");
  const YAML::Node projection = need(file, root, "projection_matrix", "projection_matrix");
  const auto p = read_matrix(file, projection, "projection_matrix", 3, 4);
  info.P << p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11];
  if (!(info.P(0, 0) > 0 && info.P(1, 1) > 0))
    file.fail(projection, "projection_matrix has no positive focal lengths");
  return info;
}

}  // namespace

CalibrationFile read_ros(const YamlFile& left, const YamlFile& right, Remarks* /*remarks*/) {
  const std::array info{read_info(left), read_info(right)};
  CalibrationFile calibration;
  for (std::size_t k = 0; k < 2; ++k)
    if (!info[k].name.empty()) calibration.names[k] = info[k].name;
  if (const std::string fault = set_ros_rig(info[0], info[1], &calibration.rig); !fault.empty())
    right.fail(right.root()["projection_matrix"],
               "projection_matrix " + fault + " (" + left.name() + " is the left camera's)");
  detail::check_read(right.name(), &calibration);
  return calibration;
}

}  // namespace vergence::app
