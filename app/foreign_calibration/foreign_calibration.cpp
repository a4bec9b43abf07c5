#include "app/foreign_calibration/foreign_calibration.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

bool has(const YamlFile& file, const char* key) { return file.root().IsMap() && file.root()[key]; }

/// By what only one of them has.
CalibrationFormat format_of_content(const std::vector<YamlFile>& files, bool opencv_head) {
  const YamlFile& first = files.front();
  if (has(first, "cam0")) return CalibrationFormat::kalibr;
  if (has(first, "cameras")) return CalibrationFormat::vergence;
  if (has(first, "rectification_matrix") || has(first, "projection_matrix"))
    return CalibrationFormat::ros;
  if (opencv_head || has(first, "M1") || has(first, "K1") || has(first, "R"))
    return CalibrationFormat::opencv;
  if (has(first, "camera_matrix")) return CalibrationFormat::ros;
  throw InputError(first.name() +
                   ": is no calibration that this program knows: calibration.yaml (cameras), "
                   "Kalibr camchain (cam0), ROS camera_info "
                   "(camera_matrix), OpenCV stereo (M1, D1, M2, D2, R, T)");
}

/// The files of a calibration, parsed, and what only their text shows.
struct Content {
  std::vector<YamlFile> files;
  bool opencv_head = false;  // %YAML:1.0, which is no YAML
};

Content read_content(const std::string& in) {
  Content content;
  std::error_code ignored;
  for (const fs::path& path : detail::files_of(in, fs::is_directory(in, ignored))) {
    std::string text = read_text(path, kLargestYaml);
    content.opencv_head = content.opencv_head || text.starts_with("%YAML:");
    content.files.push_back(parse_opencv_yaml(std::move(text), path.string()));
    const YAML::Node& root = content.files.back().root();
    if (root.IsNull()) throw InputError(path.string() + ": is empty; a calibration is expected");
    if (!root.IsMap())
      throw InputError(path.string() +
                       ": is not a group of keys (`key: value`); a calibration is expected");
  }
  return content;
}

void refuse_number_of_files(const std::string& in, const char* what) {
  throw InputError(fmt::format("{}: {}", in, what));
}

}  // namespace

namespace detail {

std::vector<std::filesystem::path> files_of(const std::string& text, bool folder) {
  if (folder) return {fs::path(text) / "left.yaml", fs::path(text) / "right.yaml"};
  std::error_code ignored;
  if (const auto comma = text.find(',');
      comma != std::string::npos && !fs::exists(text, ignored))  // a name may have one, too
    return {text.substr(0, comma), text.substr(comma + 1)};
  return {text};
}

void check_read(const std::string& name, CalibrationFile* calibration) {
  calibration->source = "given";
  calibration->rig.baseline = calibration->rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&calibration->rig))
    throw InputError(fmt::format("{}: in the words of calibration.yaml, {}", name, bad->sentence));
}

void remark_lost(const CalibrationFile& calibration, const char* format, bool names,
                 Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  std::vector<std::string> lost;
  bool sigmas = false, serials = false;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const auto given = [](const auto& values) {
      return std::any_of(values.begin(), values.end(), [](double v) { return v != 0; });
    };
    sigmas = sigmas || given(rig.intrinsics[k].sigma) ||
             given(rig.intrinsics[k].distortion_sigma) || given(rig.sigma_noise[k]) ||
             given(rig.sigma_wide[k]) || !rig.covariance_wide[k].isZero(0);
    serials = serials || !calibration.serials[k].empty();
  }
  if (sigmas || rig.baseline_sigma != 0) lost.emplace_back("sigmas");
  if (!rig.covariance.empty()) lost.emplace_back("the covariance");
  if (serials) lost.emplace_back("serials");
  if (names) lost.emplace_back("names");
  if (!calibration.rig_name.empty()) lost.emplace_back("the rig's name");
  if (rig.found != Stamp() || rig.frames != 0) lost.emplace_back("when it was found and from what");
  if (!lost.empty())
    remarks->push_back(
        fmt::format("{} has no place for {}; left out", format, fmt::join(lost, ", ")));
}

void remark_more_cameras(const CalibrationFile& calibration, const char* format, Remarks* remarks) {
  if (calibration.rig.cameras > 2)
    remarks->push_back(fmt::format("{} holds two cameras; {} of {} are left out", format,
                                   calibration.rig.cameras - 2, calibration.rig.cameras));
}

}  // namespace detail

CalibrationFormat calibration_format(const std::string& in) {
  const Content content = read_content(in);
  return format_of_content(content.files, content.opencv_head);
}

CalibrationFile read_any_calibration(const std::string& in, const std::optional<ImageSize>& size,
                                     Remarks* remarks) {
  const auto [files, opencv_head] = read_content(in);
  switch (format_of_content(files, opencv_head)) {
    case CalibrationFormat::vergence:
      if (files.size() != 1) refuse_number_of_files(in, "calibration.yaml is one file");
      return read_calibration(files.front().name());
    case CalibrationFormat::kalibr:
      if (files.size() != 1) refuse_number_of_files(in, "a camchain is one file");
      return read_kalibr(files.front(), remarks);
    case CalibrationFormat::ros:
      if (files.size() != 2)
        refuse_number_of_files(in,
                               "camera_info of one camera makes no rig; give left.yaml,right.yaml "
                               "or a folder with them");
      return read_ros(files[0], files[1], remarks);
    case CalibrationFormat::opencv:
      break;
  }
  return read_opencv(files, size, remarks);
}

}  // namespace vergence::app
