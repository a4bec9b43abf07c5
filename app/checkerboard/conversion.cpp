#include "app/checkerboard/conversion.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

#include <fmt/format.h>

#include "app/config/calibration_checks.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOpenCvHead = "%YAML:1.0\n---\n";

bool is_folder(const std::string& text) {
  std::error_code ignored;
  return text.ends_with('/') || fs::is_directory(text, ignored);
}

/// ROS has a file a camera: OUT is a folder for both unless it names two.
bool is_ros_folder(const std::string& out, CalibrationFormat format) {
  return format == CalibrationFormat::ros && out.find(',') == std::string::npos;
}

}  // namespace

CalibrationFormat parse_format(const std::string& word) {
  constexpr std::array<std::string_view, 4> kFormatNames{"vergence", "kalibr", "ros", "opencv"};
  return static_cast<CalibrationFormat>(std::ranges::find(kFormatNames, word) -
                                        kFormatNames.begin());
}

ImageSize parse_size(const std::string& text) {
  ImageSize size;
  const char *begin = text.data(), *end = begin + text.size();
  const auto width = std::from_chars(begin, end, size.width);
  const bool cross = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = cross ? std::from_chars(width.ptr + 1, end, size.height) : width;
  if (!cross || height.ec != std::errc() || height.ptr != end || size.width < 1 || size.height < 1)
    throw InputError("--size is \"" + text.substr(0, 60) +
                     "\"; write the image's width and height in pixels, like 640x480");
  return size;
}

CalibrationFormat format_of_name(const std::string& out) {
  if (is_folder(out)) return CalibrationFormat::ros;
  const std::vector<fs::path> files = detail::split_files(out, false);
  const fs::path extension = files.front().extension();
  if (files.size() == 2)
    return extension == ".yml" ? CalibrationFormat::opencv : CalibrationFormat::ros;
  if (files.front().filename().string().find("camchain") != std::string::npos)
    return CalibrationFormat::kalibr;
  if (extension == ".yml") return CalibrationFormat::opencv;
  if (extension == ".yaml") return CalibrationFormat::vergence;
  throw InputError(
      out +
      ": the format does not follow from the file name; add --to vergence, kalibr, ros or opencv");
}

std::vector<fs::path> files_written(const std::string& out, CalibrationFormat format) {
  return detail::split_files(out, is_ros_folder(out, format));
}

const char* describe(CalibrationFormat format) noexcept {
  constexpr std::array kTexts{"calibration.yaml of this program", "a Kalibr camchain",
                              "camera_info of ROS, left and right", "stereo calibration of OpenCV"};
  return kTexts.at(static_cast<std::size_t>(format));
}

void write_any_calibration(const std::string& out, CalibrationFormat format,
                           const CalibrationFile& calibration, Remarks* remarks) {
  const bool folder = is_ros_folder(out, format);
  const std::vector<fs::path> files = detail::split_files(out, folder);
  const auto one_file = [&](const char* what) {
    if (files.size() != 1)
      throw InputError(fmt::format("{}: {} is one file; name one file", out, what));
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
      texts = files.size() == 1 ? std::vector{kOpenCvHead + parts[0] + parts[1]}
                                : std::vector{kOpenCvHead + parts[0], kOpenCvHead + parts[1]};
      break;
    }
  }
  if (folder) {
    std::error_code error;
    fs::create_directories(out, error);
    if (error)
      throw InputError(out + ": the directory for left.yaml and right.yaml cannot be created: " +
                       error.message());
  }
  for (std::size_t i = 0; i < files.size(); ++i) replace_durably(files[i], texts[i]);
}

Remarks convert_calibration(const ConversionRequest& request) {
  Remarks remarks;
  const CalibrationFormat format = request.format ? *request.format : format_of_name(request.out);
  const CalibrationFile calibration = read_any_calibration(request.in, request.size, &remarks);
  write_any_calibration(request.out, format, calibration, &remarks);
  remarks.push_back(baseline_message(calibration.rig));
  if (std::string warning = baseline_warning(calibration.rig); !warning.empty())
    remarks.push_back(std::move(warning));
  return remarks;
}

}  // namespace vergence::app
