#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>
#include <opencv2/calib3d.hpp>

#include "app/calibration/foreign_formats.hpp"
#include "app/calibration/yaml_matrix.hpp"
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

cv::Mat matrix_of(const Mat3& m) {
  return (cv::Mat_<double>(3, 3) << m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2));
}

std::string format_matrix(const char* key, const cv::Mat& m) {
  std::vector<double> values(m.begin<double>(), m.end<double>());
  for (double& v : values) v += 0.0;  // no −0
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", key, m.rows, m.cols, number_list(values));
}

std::string format_info(const Intrinsics& lens, const std::string& name, const cv::Mat& K, const cv::Mat& R, const cv::Mat& P) {
  const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
  cv::Mat D(1, radtan ? 5 : 4, CV_64F);
  std::copy_n(lens.distortion.begin(), D.cols, D.begin<double>());
  return fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", lens.width, lens.height, double_quoted(name)) +
         format_matrix("camera_matrix", K) + fmt::format("distortion_model: {}\n", radtan ? "plumb_bob" : "equidistant") +
         format_matrix("distortion_coefficients", D) + format_matrix("rectification_matrix", R) + format_matrix("projection_matrix", P);
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

std::array<std::string, 2> format_ros(const CalibrationFile& calibration, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  const Intrinsics &l = rig.intrinsics[0], &r = rig.intrinsics[1];
  if (l.kind != r.kind) throw InputError("cameras.1.model is not that of camera 0; a pair of camera_info is rectified with one model");
  if (l.width != r.width || l.height != r.height)
    throw InputError("cameras.1.size is not that of camera 0; a pair of camera_info has one size");
  std::array<cv::Mat, 2> K, D;
  for (std::size_t k = 0; k < 2; ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    K[k] = (cv::Mat_<double>(3, 3) << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
    D[k] = cv::Mat(lens.kind == CameraModelKind::pinhole_radtan ? 5 : 4, 1, CV_64F);
    std::copy_n(lens.distortion.begin(), D[k].rows, D[k].begin<double>());
  }
  const Transform& T = rig.T_camera_left[1];
  const cv::Mat R = matrix_of(T.R), t = (cv::Mat_<double>(3, 1) << T.t.x(), T.t.y(), T.t.z());
  cv::Mat R_l, R_r, P_l, P_r, Q;
  const cv::Size size(l.width, l.height);
  try {
    if (l.kind == CameraModelKind::pinhole_radtan)
      cv::stereoRectify(K[0], D[0], K[1], D[1], size, R, t, R_l, R_r, P_l, P_r, Q, cv::CALIB_ZERO_DISPARITY, 0);
    else
      cv::fisheye::stereoRectify(K[0], D[0], K[1], D[1], size, R, t, R_l, R_r, P_l, P_r, Q, cv::CALIB_ZERO_DISPARITY);
  } catch (const cv::Exception& error) {
    throw InputError(std::string("this rig cannot be rectified for camera_info: ") + error.err);
  }
  detail::remark_more_cameras(calibration, "a pair of camera_info", remarks);
  detail::remark_lost(calibration, "camera_info", false, remarks);
  return {format_info(l, calibration.names[0], K[0], R_l, P_l), format_info(r, calibration.names[1], K[1], R_r, P_r)};
}

}  // namespace vergence::app
