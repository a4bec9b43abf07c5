#include "app/checkerboard/conversion.hpp"

#include <limits>

#include "app/checkerboard/board_pattern.hpp"
#include "app/config/calibration_checks.hpp"
#include "app/recording/messages.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/transform_rows.hpp"

namespace vergence::app {
namespace {

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// List `[a, b, c]` with as many digits as reproduce the doubles.
std::string number_list(std::span<const double> values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::array<double, 9> camera_matrix(const Intrinsics& lens) {
  return {lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1};
}

std::span<const double> coefficients(const Intrinsics& lens) {
  return std::span(lens.distortion).first(lens.kind == CameraModelKind::pinhole_radtan ? 5 : 4);
}

/// Adds a remark about data that all these formats lack.
void remark_lost(const CalibrationFile& calibration, const char* format, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  bool sigmas = rig.baseline_sigma != 0 || !rig.covariance.empty();
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    sigmas = sigmas || rig.intrinsics[k].sigma[0] > 0 || rig.sigma_total[k][0] > 0;
  remarks->push_back(fmt::format(
      "{} holds intrinsics and extrinsics only; {}serial numbers and origin are left out", format,
      sigmas ? "sigmas, " : ""));
}

/// Checks a calibration for a format with one pair of cameras, and adds a remark about additional
/// cameras. Throws InputError if the two cameras differ in model or size.
void check_pair(const CalibrationFile& calibration, const char* format, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  const Intrinsics &l = rig.intrinsics[0], &r = rig.intrinsics[1];
  for (const auto& [key, same] : {std::pair("model", l.kind == r.kind),
                                  std::pair("size", l.width == r.width && l.height == r.height)})
    if (!same)
      throw InputError(
          "cameras.1.{0} differs from that of camera 0, but {1} has one {0} for both; choose "
          "another format",
          key, format);
  if (rig.cameras > 2)
    remarks->push_back(fmt::format("{} holds two cameras; {} of {} are left out", format,
                                   rig.cameras - 2, rig.cameras));
  remark_lost(calibration, format, remarks);
}

/// A matrix as ROS or OpenCV writes it.
constexpr const char *kOfRos = "{}:\n  rows: {}\n  cols: {}\n  data: {}\n",
                     *kOfOpenCv =
                         "{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: {}\n";
std::string matrix(const char* form, const char* key, int rows, int columns,
                   std::span<const double> values) {
  return fmt::format(fmt::runtime(form), key, rows, columns, number_list(values));
}

}  // namespace

namespace fs = std::filesystem;

ImageSize parse_size(const std::string& text) {
  constexpr std::int64_t kLargest = std::numeric_limits<int>::max();
  const auto sides = parse_product(text);
  if (!sides || std::ranges::min(*sides) < 1 || std::ranges::max(*sides) > kLargest)
    throw InputError("--size is \"" + text.substr(0, 60) +
                     "\"; write the image's width and height in pixels, like 640x480");
  return {static_cast<int>((*sides)[0]), static_cast<int>((*sides)[1])};
}

CalibrationFormat format_of(const std::string& word, const std::string& out) {
  constexpr std::array<std::string_view, 4> kWords{"vergence", "kalibr", "ros", "opencv"};
  if (const auto at = std::ranges::find(kWords, word); at != kWords.end())
    return static_cast<CalibrationFormat>(at - kWords.begin());
  std::error_code ignored;
  const fs::path file = out;
  if (!file.has_filename() || fs::is_directory(file, ignored)) return CalibrationFormat::ros;
  if (file.extension() == ".yml") return CalibrationFormat::opencv;
  if (out.find(',') != std::string::npos) return CalibrationFormat::ros;
  if (file.filename().string().find("camchain") != std::string::npos)
    return CalibrationFormat::kalibr;
  if (file.extension() == ".yaml") return CalibrationFormat::vergence;
  throw InputError(
      out +
      ": the format does not follow from the file name; add --to vergence, kalibr, ros or opencv");
}

const char* describe(CalibrationFormat format) noexcept {
  constexpr std::array kTexts{"calibration.yaml of this program", "a Kalibr camchain",
                              "camera_info of ROS, left and right", "stereo calibration of OpenCV"};
  return kTexts.at(static_cast<std::size_t>(format));
}

WrittenFiles format_calibration_as(CalibrationFormat format, const std::string& out,
                                   const CalibrationFile& calibration, Remarks* remarks) {
  const auto comma = out.find(',');
  const bool two = comma != std::string::npos;
  const std::string first = out.substr(0, comma), second = two ? out.substr(comma + 1) : "";
  if (two && (format == CalibrationFormat::vergence || format == CalibrationFormat::kalibr))
    throw InputError("{}: {} is one file; name one file", out, describe(format));
  if (format == CalibrationFormat::vergence) return {{out, format_calibration(calibration)}};
  if (format == CalibrationFormat::kalibr) return {{out, format_kalibr(calibration, remarks)}};
  const bool ros = format == CalibrationFormat::ros;
  auto [one, other] = ros ? format_ros(calibration, remarks) : format_opencv(calibration, remarks);
  const std::string head = ros ? "" : "%YAML:1.0\n---\n";
  if (two) return {{first, head + one}, {second, head + other}};
  if (ros) return {{fs::path(out) / "left.yaml", one}, {fs::path(out) / "right.yaml", other}};
  return {{out, head + one + other}};
}

Remarks convert_calibration(const ConversionRequest& request) {
  Remarks remarks;
  const CalibrationFile calibration = read_any_calibration(request.in, request.size, &remarks);
  const WrittenFiles files =
      format_calibration_as(request.format, request.out, calibration, &remarks);
  for (const auto& [file, text] : files)
    if (fs::exists(file) && !request.force)
      throw InputError(file.string() +
                       ": exists already; add --force to overwrite it, or name another file");
  std::error_code error;
  if (request.format == CalibrationFormat::ros && request.out.find(',') == std::string::npos)
    fs::create_directories(request.out, error);
  if (error)
    throw InputError(
        request.out +
        ": the directory for left.yaml and right.yaml cannot be created: " + error.message());
  for (const auto& [file, text] : files) replace_durably(file, text);
  remarks.push_back(baseline_message(calibration.rig));
  if (std::string warning = baseline_warning(calibration.rig); !warning.empty())
    remarks.push_back(std::move(warning));
  remarks.push_back(fmt::format("{}: written as {}", request.out, describe(request.format)));
  return remarks;
}

std::string format_kalibr(const CalibrationFile& calibration, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  std::string text;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
    if (radtan && lens.distortion[4] != 0)
      throw InputError(
          "cameras.{}.distortion has k3 = {}; Kalibr's radtan has four coefficients, calibrate "
          "without --k3",
          k, lens.distortion[4]);
    text += fmt::format("cam{}:\n", k);
    if (k > 0) {
      const auto rows = rows_of(rig.T_camera_left[k] * rig.T_camera_left[k - 1].inverse());
      text += "  T_cn_cnm1:\n";
      for (std::size_t row = 0; row < 3; ++row)
        text += "  - " + number_list(std::span(rows).subspan(4 * row, 4)) + "\n";
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
  remark_lost(calibration, "a camchain", remarks);
  return text;
}

std::array<std::string, 2> format_ros(const CalibrationFile& calibration, Remarks* remarks) {
  check_pair(calibration, "a pair of camera_info", remarks);
  std::array<std::string, 2> texts;
  for (std::size_t k = 0; k < 2; ++k) {
    const Intrinsics& lens = calibration.rig.intrinsics[k];
    const Rectification r = rectification(calibration.rig, static_cast<int>(k), true);
    const RowMajor3 R = r.R;
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> P = r.P;
    const auto D = coefficients(lens);
    texts[k] = fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", lens.width,
                           lens.height, double_quoted(calibration.names[k])) +
               matrix(kOfRos, "camera_matrix", 3, 3, camera_matrix(lens)) +
               fmt::format("distortion_model: {}\n", D.size() == 5 ? "plumb_bob" : "equidistant") +
               matrix(kOfRos, "distortion_coefficients", 1, static_cast<int>(D.size()), D) +
               matrix(kOfRos, "rectification_matrix", 3, 3, std::span(R.data(), 9)) +
               matrix(kOfRos, "projection_matrix", 3, 4, std::span(P.data(), 12));
  }
  return texts;
}

std::array<std::string, 2> format_opencv(const CalibrationFile& calibration, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  const Intrinsics& l = rig.intrinsics[0];
  check_pair(calibration, "an OpenCV stereo file", remarks);
  const bool fisheye = l.kind == CameraModelKind::pinhole_equidistant;
  std::string lenses = fmt::format("image_width: {}\nimage_height: {}\nfisheye_model: {}\n",
                                   l.width, l.height, fisheye ? 1 : 0);
  for (std::size_t k = 0; k < 2; ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    lenses += matrix(kOfOpenCv, k == 0 ? "M1" : "M2", 3, 3, camera_matrix(lens));
    lenses += matrix(kOfOpenCv, k == 0 ? "D1" : "D2", fisheye ? 4 : 1, fisheye ? 1 : 5,
                     coefficients(lens));
  }
  const Transform& T = rig.T_camera_left[1];
  const RowMajor3 R = T.R;
  return {lenses, matrix(kOfOpenCv, "R", 3, 3, std::span(R.data(), 9)) +
                      matrix(kOfOpenCv, "T", 3, 1, std::span(T.t.data(), 3))};
}

}  // namespace vergence::app
