#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "app/foreign_calibration/foreign_formats.hpp"
#include "app/foreign_calibration/yaml_matrix.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr double kSameRectification = 1e-6;  // relative: focal lengths of the two projection matrices

struct CameraInfo {
  std::string name;
  Intrinsics lens;
  Mat3 R;   // rectification
  Mat34 P;  // of rectified images
};

Intrinsics read_lens(const YamlFile& file) {
  const YAML::Node& root = file.root();
  Intrinsics lens;
  lens.width = read_side(file, need(file, root, "image_width", "image_width"), "image_width");
  lens.height = read_side(file, need(file, root, "image_height", "image_height"), "image_height");
  const YAML::Node matrix = need(file, root, "camera_matrix", "camera_matrix");
  const auto K = read_matrix(file, matrix, "camera_matrix", 3, 3);
  if (K[1] != 0 || K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1) file.fail(matrix, "camera_matrix is not [fx 0 cx; 0 fy cy; 0 0 1]");
  lens.fx = K[0], lens.fy = K[4], lens.cx = K[2], lens.cy = K[5];
  const YAML::Node model = need(file, root, "distortion_model", "distortion_model");
  const std::string word = file.text(model, "distortion_model");
  const YAML::Node node = need(file, root, "distortion_coefficients", "distortion_coefficients");
  if (word == "plumb_bob" || word == "rational_polynomial") {
    const auto d = read_vector(file, node, "distortion_coefficients", 0, 8);
    if (std::any_of(d.begin() + std::min<std::ptrdiff_t>(5, static_cast<std::ptrdiff_t>(d.size())), d.end(),
                    [](double v) { return v != 0; }))
      file.fail(
          node,
          "distortion_coefficients has k4 to k6 of a rational polynomial, which this program's radtan has not; calibrate as plumb_bob");
    std::copy_n(d.begin(), std::min<std::size_t>(5, d.size()), lens.distortion.begin());
  } else if (word == "equidistant") {
    lens.kind = CameraModelKind::pinhole_equidistant;
    const auto d = read_vector(file, node, "distortion_coefficients", 4, 4);
    std::copy(d.begin(), d.end(), lens.distortion.begin());
  } else {
    file.fail(model,
              fmt::format("distortion_model is \"{}\"; plumb_bob, equidistant and rational_polynomial are known", word.substr(0, 60)));
  }
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
  if (!(info.P(0, 0) > 0 && info.P(1, 1) > 0)) file.fail(projection, "projection_matrix has no positive focal lengths");
  return info;
}

}  // namespace

CalibrationFile read_ros(const YamlFile& left, const YamlFile& right, Remarks* /*remarks*/) {
  const std::array info{read_info(left), read_info(right)};
  CalibrationFile calibration;
  RigCalibration& rig = calibration.rig;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k) {
    rig.intrinsics[k] = info[k].lens;
    if (!info[k].name.empty()) calibration.names[k] = info[k].name;
  }
  const auto fail = [&](const std::string& sentence) { right.fail(right.root()["projection_matrix"], sentence); };
  const Mat34 &P_l = info[0].P, &P_r = info[1].P;
  if (std::abs(P_l(0, 0) - P_r(0, 0)) > kSameRectification * P_l(0, 0) || std::abs(P_l(1, 1) - P_r(1, 1)) > kSameRectification * P_l(1, 1))
    fail(fmt::format("projection_matrix has the focal length {}, that of {} {}: they are not of one stereo calibration", P_r(0, 0),
                     left.name(), P_l(0, 0)));
  const Vec3 apart((P_r(0, 3) - P_l(0, 3)) / P_r(0, 0), (P_r(1, 3) - P_l(1, 3)) / P_r(1, 1), 0);
  if (apart.norm() == 0) fail("projection_matrix has no baseline: the fourth number of its first row is −fx·B in a stereo calibration");
  Transform& T = rig.T_camera_left[1];
  T.R = info[1].R.transpose() * info[0].R;
  T.t = info[1].R.transpose() * apart;
  detail::check_read(right.name(), &calibration);
  return calibration;
}

}  // namespace vergence::app
