#include <utility>

#include <fmt/format.h>

#include "app/checkerboard/written_formats.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

std::string format_matrix(const char* key, int rows, int columns, std::span<const double> values) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: {}\n", key,
                     rows, columns, number_list(values));
}

}  // namespace

std::string number_list(std::span<const double> values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

namespace detail {

void remark_lost(const CalibrationFile& calibration, const char* format, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  bool sigmas = rig.baseline_sigma != 0 || !rig.covariance.empty();
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    sigmas = sigmas || rig.intrinsics[k].sigma[0] > 0 || rig.sigma_total[k][0] > 0;
  remarks->push_back(fmt::format(
      "{} holds intrinsics and extrinsics only; {}serial numbers and origin are left out", format,
      sigmas ? "sigmas, " : ""));
}

void check_pair(const CalibrationFile& calibration, const char* format, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  const Intrinsics &l = rig.intrinsics[0], &r = rig.intrinsics[1];
  for (const auto& [key, same] : {std::pair("model", l.kind == r.kind),
                                  std::pair("size", l.width == r.width && l.height == r.height)})
    if (!same)
      throw InputError(
          fmt::format("cameras.1.{0} differs from that of camera 0, but {1} has one {0} for both; "
                      "choose another format",
                      key, format));
  if (rig.cameras > 2)
    remarks->push_back(fmt::format("{} holds two cameras; {} of {} are left out", format,
                                   rig.cameras - 2, rig.cameras));
  remark_lost(calibration, format, remarks);
}

}  // namespace detail

std::string format_kalibr(const CalibrationFile& calibration, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  std::string text;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
    if (radtan && lens.distortion[4] != 0)
      throw InputError(
          fmt::format("cameras.{}.distortion has k3 = {}; Kalibr's radtan has four coefficients, "
                      "calibrate without --k3",
                      k, lens.distortion[4]));
    text += fmt::format("cam{}:\n", k);
    if (k > 0) {
      const Transform T = rig.T_camera_left[k] * rig.T_camera_left[k - 1].inverse();
      text += "  T_cn_cnm1:\n";
      for (int row = 0; row < 3; ++row)
        text += "  - " + number_list(std::array{T.R(row, 0), T.R(row, 1), T.R(row, 2), T.t(row)}) +
                "\n";
      text += "  - [0.0, 0.0, 0.0, 1.0]\n";
    }
    std::vector<int> others;
    for (int other = 0; other < rig.cameras; ++other)
      if (other != static_cast<int>(k)) others.push_back(other);
    text += fmt::format("  cam_overlaps: [{}]\n  camera_model: pinhole\n", fmt::join(others, ", "));
    text += "  distortion_coeffs: " + number_list(std::span(lens.distortion).first(4)) + "\n";
    text += fmt::format("  distortion_model: {}\n", radtan ? "radtan" : "equidistant");
    text += "  intrinsics: " + number_list(std::array{lens.fx, lens.fy, lens.cx, lens.cy}) + "\n";
    text += fmt::format("  resolution: [{}, {}]\n", lens.width, lens.height);
    std::string name = calibration.names[k];
    std::ranges::replace(name, '/', '_');
    text += "  rostopic: " + double_quoted("/" + name + "/image_raw") + "\n";
  }
  detail::remark_lost(calibration, "a camchain", remarks);
  return text;
}

std::array<std::string, 2> format_opencv(const CalibrationFile& calibration, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  const Intrinsics& l = rig.intrinsics[0];
  detail::check_pair(calibration, "an OpenCV stereo file", remarks);
  const bool fisheye = l.kind == CameraModelKind::pinhole_equidistant;
  std::string lenses = fmt::format("image_width: {}\nimage_height: {}\nfisheye_model: {}\n",
                                   l.width, l.height, fisheye ? 1 : 0);
  for (std::size_t k = 0; k < 2; ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    const std::size_t coefficients = fisheye ? 4 : 5;
    lenses +=
        format_matrix(k == 0 ? "M1" : "M2", 3, 3,
                      std::array{lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0});
    lenses += format_matrix(k == 0 ? "D1" : "D2", fisheye ? 4 : 1, fisheye ? 1 : 5,
                            std::span(lens.distortion).first(coefficients));
  }
  const Transform& T = rig.T_camera_left[1];
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = T.R;
  return {lenses, format_matrix("R", 3, 3, std::span(R.data(), 9)) +
                      format_matrix("T", 3, 1, std::span(T.t.data(), 3))};
}

}  // namespace vergence::app
