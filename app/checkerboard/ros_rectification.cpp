// camera_info holds a rectification: writing it is OpenCV's work, reading it is not
// (app/datasets/ros_camera.cpp).
#include <algorithm>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "app/checkerboard/written_formats.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

cv::Mat to_mat(const Mat3& m) {
  return (cv::Mat_<double>(3, 3) << m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0),
          m(2, 1), m(2, 2));
}

std::string format_matrix(const char* key, const cv::Mat& m) {
  std::vector<double> values(m.begin<double>(), m.end<double>());
  // Adding 0.0 turns a negative zero into a positive one.
  for (double& v : values) v += 0.0;
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", key, m.rows, m.cols,
                     number_list(values));
}

std::string format_info(const Intrinsics& lens, const std::string& name, const cv::Mat& K,
                        const cv::Mat& R, const cv::Mat& P) {
  const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
  cv::Mat D(1, radtan ? 5 : 4, CV_64F);
  std::copy_n(lens.distortion.begin(), D.cols, D.begin<double>());
  return fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", lens.width,
                     lens.height, double_quoted(name)) +
         format_matrix("camera_matrix", K) +
         fmt::format("distortion_model: {}\n", radtan ? "plumb_bob" : "equidistant") +
         format_matrix("distortion_coefficients", D) + format_matrix("rectification_matrix", R) +
         format_matrix("projection_matrix", P);
}

}  // namespace

std::array<std::string, 2> format_ros(const CalibrationFile& calibration, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  const Intrinsics &l = rig.intrinsics[0], &r = rig.intrinsics[1];
  detail::check_pair(calibration, "a pair of camera_info", remarks);
  std::array<cv::Mat, 2> K, D;
  for (std::size_t k = 0; k < 2; ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    K[k] = (cv::Mat_<double>(3, 3) << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
    D[k] = cv::Mat(lens.kind == CameraModelKind::pinhole_radtan ? 5 : 4, 1, CV_64F);
    std::copy_n(lens.distortion.begin(), D[k].rows, D[k].begin<double>());
  }
  const Transform& T = rig.T_camera_left[1];
  const cv::Mat R = to_mat(T.R), t = (cv::Mat_<double>(3, 1) << T.t.x(), T.t.y(), T.t.z());
  cv::Mat R_l, R_r, P_l, P_r, Q;
  const cv::Size size(l.width, l.height);
  try {
    if (l.kind == CameraModelKind::pinhole_radtan)
      cv::stereoRectify(K[0], D[0], K[1], D[1], size, R, t, R_l, R_r, P_l, P_r, Q,
                        cv::CALIB_ZERO_DISPARITY, 0);
    else
      cv::fisheye::stereoRectify(K[0], D[0], K[1], D[1], size, R, t, R_l, R_r, P_l, P_r, Q,
                                 cv::CALIB_ZERO_DISPARITY);
  } catch (const cv::Exception& error) {
    throw InputError(
        std::string("this rig cannot be rectified for camera_info; use --to kalibr or opencv: ") +
        error.err);
  }
  return {format_info(l, calibration.names[0], K[0], R_l, P_l),
          format_info(r, calibration.names[1], K[1], R_r, P_r)};
}

}  // namespace vergence::app
