#include "app/calibration/conversion.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "app/datasets/text_file.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOpenCvHead = "%YAML:1.0\n---\n";

/// The files that IN or OUT stand for; a folder stands for left.yaml and right.yaml in it.
std::vector<fs::path> files_of(const std::string& text, bool folder) {
  if (folder) return {fs::path(text) / "left.yaml", fs::path(text) / "right.yaml"};
  if (const auto comma = text.find(','); comma != std::string::npos) return {text.substr(0, comma), text.substr(comma + 1)};
  return {text};
}

bool is_folder(const std::string& text) {
  std::error_code ignored;
  return text.ends_with('/') || fs::is_directory(text, ignored);
}

/// ROS has a file a camera: OUT is a folder for both unless it names two.
bool is_ros_folder(const std::string& out, CalibrationFormat format) {
  return format == CalibrationFormat::ros && out.find(',') == std::string::npos;
}

bool has(const YamlFile& file, const char* key) { return file.root().IsMap() && file.root()[key]; }

/// By what only one of them has.
CalibrationFormat format_of_content(const std::vector<YamlFile>& files, bool opencv_head) {
  const YamlFile& first = files.front();
  if (has(first, "cam0")) return CalibrationFormat::kalibr;
  if (has(first, "cameras")) return CalibrationFormat::vergence;
  if (has(first, "rectification_matrix") || has(first, "projection_matrix")) return CalibrationFormat::ros;
  if (opencv_head || has(first, "M1") || has(first, "K1") || has(first, "R")) return CalibrationFormat::opencv;
  if (has(first, "camera_matrix")) return CalibrationFormat::ros;
  throw InputError(first.name() +
                   ": is no calibration that this program knows: calibration.yaml (cameras), Kalibr camchain (cam0), ROS camera_info "
                   "(camera_matrix), OpenCV stereo (M1, D1, M2, D2, R, T)");
}

void refuse_number_of_files(const std::string& in, const char* what) { throw InputError(fmt::format("{}: {}", in, what)); }

}  // namespace

namespace detail {

void check_read(const std::string& name, CalibrationFile* calibration) {
  calibration->source = "given";
  calibration->rig.baseline = calibration->rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&calibration->rig))
    throw InputError(fmt::format("{}: in the words of calibration.yaml, {}", name, bad->sentence));
}

void remark_lost(const CalibrationFile& calibration, const char* format, bool names, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  std::vector<std::string> lost;
  bool sigmas = false, serials = false;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const auto given = [](const auto& values) { return std::any_of(values.begin(), values.end(), [](double v) { return v != 0; }); };
    sigmas = sigmas || given(rig.intrinsics[k].sigma) || given(rig.intrinsics[k].distortion_sigma) || given(rig.sigma_noise[k]) ||
             given(rig.sigma_wide[k]) || !rig.covariance_wide[k].isZero(0);
    serials = serials || !calibration.serials[k].empty();
  }
  if (sigmas || rig.baseline_sigma != 0) lost.emplace_back("sigmas");
  if (!rig.covariance.empty()) lost.emplace_back("the covariance");
  if (serials) lost.emplace_back("serials");
  if (names) lost.emplace_back("names");
  if (!calibration.rig_name.empty()) lost.emplace_back("the rig's name");
  if (rig.found != Stamp() || rig.frames != 0) lost.emplace_back("when it was found and from what");
  if (!lost.empty()) remarks->push_back(fmt::format("{} has no place for {}; left out", format, fmt::join(lost, ", ")));
}

void remark_more_cameras(const CalibrationFile& calibration, const char* format, Remarks* remarks) {
  if (calibration.rig.cameras > 2)
    remarks->push_back(
        fmt::format("{} holds two cameras; {} of {} are left out", format, calibration.rig.cameras - 2, calibration.rig.cameras));
}

}  // namespace detail

CalibrationFormat parse_format(const std::string& word) {
  static const std::vector<std::string> kWords{"vergence", "kalibr", "ros", "opencv"};
  const auto at = std::find(kWords.begin(), kWords.end(), word);
  if (at == kWords.end())
    throw InputError(fmt::format("\"{}\" is no form of a calibration{}; it is one of {}", word.substr(0, 60), did_you_mean(word, kWords),
                                 fmt::join(kWords, ", ")));
  return static_cast<CalibrationFormat>(at - kWords.begin());
}

ImageSize parse_size(const std::string& text) {
  ImageSize size;
  const char *begin = text.data(), *end = begin + text.size();
  const auto width = std::from_chars(begin, end, size.width);
  const bool cross = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = cross ? std::from_chars(width.ptr + 1, end, size.height) : width;
  if (!cross || height.ec != std::errc() || height.ptr != end || size.width < 1 || size.height < 1)
    throw InputError("--size is \"" + text.substr(0, 60) + "\"; it takes the image's width and height in pixels, like 640x480");
  return size;
}

CalibrationFormat format_of_name(const std::string& out) {
  if (is_folder(out)) return CalibrationFormat::ros;
  const std::vector<fs::path> files = files_of(out, false);
  const fs::path extension = files.front().extension();
  if (files.size() == 2) return extension == ".yml" ? CalibrationFormat::opencv : CalibrationFormat::ros;
  if (files.front().filename().string().find("camchain") != std::string::npos) return CalibrationFormat::kalibr;
  if (extension == ".yml") return CalibrationFormat::opencv;
  if (extension == ".yaml") return CalibrationFormat::vergence;
  throw InputError(out + ": its name does not tell what it is to be; add --to vergence, kalibr, ros or opencv");
}

CalibrationFile read_any_calibration(const std::string& in, const std::optional<ImageSize>& size, Remarks* remarks) {
  std::vector<YamlFile> files;
  bool opencv_head = false;
  std::error_code ignored;
  for (const fs::path& path : files_of(in, fs::is_directory(in, ignored))) {
    std::string text = read_text(path, kLargestYaml);
    opencv_head = opencv_head || text.starts_with("%YAML:");
    files.push_back(parse_opencv_yaml(std::move(text), path.string()));
    if (files.back().root().IsNull()) throw InputError(path.string() + ": is empty; a calibration is expected");
    if (!files.back().root().IsMap())
      throw InputError(path.string() + ": is not a group of keys (`key: value`); a calibration is expected");
  }
  switch (format_of_content(files, opencv_head)) {
    case CalibrationFormat::vergence:
      if (files.size() != 1) refuse_number_of_files(in, "calibration.yaml is one file");
      return read_calibration(files.front().name());
    case CalibrationFormat::kalibr:
      if (files.size() != 1) refuse_number_of_files(in, "a camchain is one file");
      return read_kalibr(files.front(), remarks);
    case CalibrationFormat::ros:
      if (files.size() != 2)
        refuse_number_of_files(in, "camera_info of one camera makes no rig; give left.yaml,right.yaml or a folder with them");
      return read_ros(files[0], files[1], remarks);
    case CalibrationFormat::opencv:
      break;
  }
  return read_opencv(files, size, remarks);
}

std::vector<fs::path> files_written(const std::string& out, CalibrationFormat format) { return files_of(out, is_ros_folder(out, format)); }

const char* describe(CalibrationFormat format) noexcept {
  switch (format) {
    case CalibrationFormat::vergence:
      return "calibration.yaml of this program";
    case CalibrationFormat::kalibr:
      return "a Kalibr camchain";
    case CalibrationFormat::ros:
      return "camera_info of ROS, left and right";
    case CalibrationFormat::opencv:
      return "stereo calibration of OpenCV";
  }
  return "";
}

void write_any_calibration(const std::string& out, CalibrationFormat format, const CalibrationFile& calibration, Remarks* remarks) {
  const bool folder = is_ros_folder(out, format);
  const std::vector<fs::path> files = files_of(out, folder);
  const auto one_file = [&](const char* what) {
    if (files.size() != 1) throw InputError(fmt::format("{}: {} is one file", out, what));
  };
  std::vector<std::string> texts;
  switch (format) {
    case CalibrationFormat::vergence:
      one_file("calibration.yaml");
      texts = {format_calibration(calibration)};
      break;
    case CalibrationFormat::kalibr:
      one_file("a camchain");
      texts = {format_kalibr(calibration, remarks)};
      break;
    case CalibrationFormat::ros: {
      const auto pair = format_ros(calibration, remarks);
      texts = {pair[0], pair[1]};
      break;
    }
    case CalibrationFormat::opencv: {
      const auto parts = format_opencv(calibration, remarks);
      texts =
          files.size() == 1 ? std::vector{kOpenCvHead + parts[0] + parts[1]} : std::vector{kOpenCvHead + parts[0], kOpenCvHead + parts[1]};
      break;
    }
  }
  if (folder) {
    std::error_code error;
    fs::create_directories(out, error);
    if (error) throw InputError(out + ": cannot be made a folder for left.yaml and right.yaml: " + error.message());
  }
  for (std::size_t i = 0; i < files.size(); ++i) replace_durably(files[i], texts[i]);
}

Remarks convert_calibration(const ConversionRequest& request) {
  Remarks remarks;
  const CalibrationFormat format = request.format ? *request.format : format_of_name(request.out);
  const CalibrationFile calibration = read_any_calibration(request.in, request.size, &remarks);
  write_any_calibration(request.out, format, calibration, &remarks);
  return remarks;
}

}  // namespace vergence::app
