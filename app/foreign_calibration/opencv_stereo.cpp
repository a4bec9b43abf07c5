#include <algorithm>
#include <span>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "app/foreign_calibration/foreign_formats.hpp"
#include "app/foreign_calibration/yaml_matrix.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

/// Names that programs around OpenCV give the same thing; the first is that of its own sample.
constexpr std::array kMatrix1{"M1",
                              "K1",
                              "cameraMatrix1",
                              "camera_matrix1",
                              "camera_matrix_1",
                              "cameraMatrixL",
                              "CM1",
                              "left_camera_matrix"};
constexpr std::array kMatrix2{"M2",
                              "K2",
                              "cameraMatrix2",
                              "camera_matrix2",
                              "camera_matrix_2",
                              "cameraMatrixR",
                              "CM2",
                              "right_camera_matrix"};
constexpr std::array kDistortion1{"D1",
                                  "distCoeffs1",
                                  "dist_coeffs1",
                                  "dist_coeffs_1",
                                  "distortion_coefficients_1",
                                  "distCoeffsL",
                                  "distCoeff1",
                                  "left_distortion_coefficients"};
constexpr std::array kDistortion2{"D2",
                                  "distCoeffs2",
                                  "dist_coeffs2",
                                  "dist_coeffs_2",
                                  "distortion_coefficients_2",
                                  "distCoeffsR",
                                  "distCoeff2",
                                  "right_distortion_coefficients"};
constexpr std::array kRotation{"R", "rotation", "Rotation", "rotation_matrix"};
constexpr std::array kTranslation{"T", "t", "translation", "Translation", "translation_vector"};
constexpr std::array kSize{"imageSize", "image_size", "img_size", "size"};
constexpr std::array kWidth{"image_width", "width", "image_Width"};
constexpr std::array kHeight{"image_height", "height", "image_Height"};

/// A key in whichever of the files has it.
struct Entry {
  const YamlFile* file = nullptr;
  YAML::Node node{};
  std::string key{};
};

std::optional<Entry> find(const std::vector<YamlFile>& files, std::span<const char* const> keys) {
  for (const YamlFile& file : files) {
    if (!file.root().IsMap()) continue;
    std::string key;
    const YAML::Node node = first_of(file.root(), keys, &key);
    if (node.IsDefined()) return Entry{&file, node, key};
  }
  return std::nullopt;
}

Entry need_entry(const std::vector<YamlFile>& files, std::span<const char* const> keys,
                 const char* what) {
  if (auto entry = find(files, keys)) return *entry;
  std::string names;
  for (const YamlFile& file : files) names += (names.empty() ? "" : ", ") + file.name();
  throw InputError(fmt::format("{}: {} is missing ({} or {})", names, what, keys[0], keys[1]));
}

/// → how many distortion coefficients there are.
std::size_t read_lens(const std::vector<YamlFile>& files, std::span<const char* const> matrix,
                      std::span<const char* const> distortion, bool fisheye, Intrinsics* lens) {
  const Entry m = need_entry(files, matrix, "a camera matrix");
  const auto K = read_matrix(*m.file, m.node, m.key, 3, 3);
  if (K[1] != 0 || K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1)
    m.file->fail(m.node, m.key + " is not [fx 0 cx; 0 fy cy; 0 0 1]");
  lens->fx = K[0], lens->fy = K[4], lens->cx = K[2], lens->cy = K[5];
  const Entry d = need_entry(files, distortion, "a list of distortion coefficients");
  constexpr std::size_t kModelled = 5, kMostOfOpenCv = 14;
  const auto values = fisheye ? read_vector(*d.file, d.node, d.key, 4, 4)
                              : read_vector(*d.file, d.node, d.key, 0, kMostOfOpenCv);
  if (fisheye) lens->kind = CameraModelKind::pinhole_equidistant;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i < kModelled)
      lens->distortion[i] = values[i];
    else if (values[i] != 0)
      d.file->fail(d.node, fmt::format("{} has a sixth or later coefficient (rational, thin prism "
                                       "or tilted model), which this program's "
                                       "radtan has not; calibrate with k1 k2 p1 p2 k3",
                                       d.key));
  }
  return values.size();
}

ImageSize read_size(const std::vector<YamlFile>& files, const std::optional<ImageSize>& given) {
  const auto width = find(files, kWidth), height = find(files, kHeight);
  if (width && height)
    return {read_side(*width->file, width->node, width->key),
            read_side(*height->file, height->node, height->key)};
  if (const auto size = find(files, kSize)) {
    if (!size->node.IsSequence() || size->node.size() != 2)
      size->file->fail(size->node, size->key + " is not [width, height]");
    return {read_side(*size->file, size->node[0], size->key),
            read_side(*size->file, size->node[1], size->key)};
  }
  if (!given)
    throw InputError(
        files.front().name() +
        ": holds no image size, as OpenCV's sample writes none; add --size WIDTHxHEIGHT");
  return *given;
}

/// What the files say; nothing: they say nothing.
std::optional<bool> is_fisheye(const std::vector<YamlFile>& files) {
  constexpr std::array kFisheye{"fisheye_model"};
  const auto entry = find(files, kFisheye);
  if (!entry) return std::nullopt;
  return entry->file->integer(entry->node, entry->key, 0, 1) == 1;
}

std::string format_matrix(const char* key, int rows, int columns, std::span<const double> values) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: {}\n", key,
                     rows, columns, number_list(values));
}

}  // namespace

YamlFile parse_opencv_yaml(std::string text, const std::string& name) {
  if (text.starts_with("%YAML:"))
    std::fill(text.begin(),
              text.begin() + static_cast<std::ptrdiff_t>(std::min(text.find('\n'), text.size())),
              ' ');
  return YamlFile::parse(text, name);
}

CalibrationFile read_opencv(const std::vector<YamlFile>& files,
                            const std::optional<ImageSize>& size, Remarks* remarks) {
  CalibrationFile calibration;
  RigCalibration& rig = calibration.rig;
  rig.cameras = 2;
  const auto said = is_fisheye(files);
  const bool fisheye = said.value_or(false);
  const std::array coefficients{
      read_lens(files, kMatrix1, kDistortion1, fisheye, &rig.intrinsics[0]),
      read_lens(files, kMatrix2, kDistortion2, fisheye, &rig.intrinsics[1])};
  // stereoCalibrate writes five or more unless it is told otherwise, its fisheye namesake four.
  if (!said && std::count(coefficients.begin(), coefficients.end(), 4U) > 0)
    remarks->push_back(
        files.front().name() +
        ": four distortion coefficients are taken for k1 k2 p1 p2 (radtan); if they are k1 k2 k3 "
        "k4 of cv::fisheye, add the line `fisheye_model: 1`, else `fisheye_model: 0`");
  const Entry R = need_entry(files, kRotation, "the rotation of camera 2 from camera 1");
  const auto r = read_matrix(*R.file, R.node, R.key, 3, 3);
  const Entry T = need_entry(files, kTranslation, "the translation of camera 2 from camera 1");
  const auto t = read_vector(*T.file, T.node, T.key, 3, 3);
  rig.T_camera_left[1].R << r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8];
  rig.T_camera_left[1].t << t[0], t[1], t[2];
  const ImageSize pixels = read_size(files, size);
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k].width = pixels.width, rig.intrinsics[k].height = pixels.height;
  detail::check_read(T.file->name(), &calibration);
  return calibration;
}

std::array<std::string, 2> format_opencv(const CalibrationFile& calibration, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  const Intrinsics &l = rig.intrinsics[0], &r = rig.intrinsics[1];
  if (l.kind != r.kind)
    throw InputError(
        "cameras.1.model is not that of camera 0; an OpenCV stereo file has one model");
  if (l.width != r.width || l.height != r.height)
    throw InputError("cameras.1.size is not that of camera 0; an OpenCV stereo file has one size");
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
  detail::remark_more_cameras(calibration, "an OpenCV stereo file", remarks);
  detail::remark_lost(calibration, "an OpenCV stereo file", true, remarks);
  return {lenses, format_matrix("R", 3, 3, std::span(R.data(), 9)) +
                      format_matrix("T", 3, 1, std::span(T.t.data(), 3))};
}

}  // namespace vergence::app
