#pragma once
#include <cstdint>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/temporary_folder.hpp"

/// Data sets of a few tiny images, in each of the layouts that are read.
namespace vergence::test {

/// Size in px; the width is no multiple of a cache line.
inline constexpr int kTinyWidth = 70, kTinyHeight = 48;

/// Pixel (x, y) of image `seed`: a pattern that compresses badly, so that a file has many bytes to
/// lose.
inline std::uint8_t tiny_pixel(int x, int y, int seed) {
  const auto mixed =
      static_cast<std::uint32_t>(x * 7919 + y * 104729 + seed * 1299709) * 2654435761U;
  return static_cast<std::uint8_t>(mixed >> 24U);
}

inline void write_tiny_image(const std::filesystem::path& file, int seed, int width = kTinyWidth,
                             int height = kTinyHeight) {
  std::filesystem::create_directories(file.parent_path());
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.at<std::uint8_t>(y, x) = tiny_pixel(x, y, seed);
  if (!cv::imwrite(file.string(), image)) throw std::runtime_error("cannot write " + file.string());
}

/// Seed of image k of pair i.
inline int tiny_seed(int pair, int camera) { return 2 * pair + camera; }

inline std::string kitti_name(int camera, int pair) {
  return fmt::format("image_{}/{:06d}.png", camera, pair);
}

inline void write_tiny_kitti(const TemporaryFolder& folder, int pairs) {
  std::string times;
  for (int i = 0; i < pairs; ++i) {
    times += fmt::format("{:.6e}\n", 0.1 * i);
    for (int k = 0; k < 2; ++k) write_tiny_image(folder / kitti_name(k, i), tiny_seed(i, k));
  }
  folder.write("times.txt", times);
  folder.write("calib.txt", "P0: 60 0 35 0 0 60 24 0 0 0 1 0\nP1: 60 0 35 -30 0 60 24 0 0 0 1 0\n");
}

inline std::string tiny_sensor_yaml(const std::string& first_line, double x,
                                    const std::string& end) {
  std::string text =
      first_line + "#camera\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n" +
      fmt::format(
          "  data: [0.0, -1.0, 0.0, {}, 1.0, 0.0, 0.0, {}, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, "
          "1.0]\n",
          0.1, x) +
      "rate_hz: 20\nresolution: [70, 48]\ncamera_model: pinhole\nintrinsics: [60, 61, 35, 24] #fu, "
      "fv, cu, cv\n"
      "distortion_model: radial-tangential\ndistortion_coefficients: [-0.2, 0.05, 0.001, -0.002]\n";
  std::string out;
  for (const char c : text) out += c == '\n' ? end : std::string(1, c);
  return out;
}

/// First stamp in ns, whose last digits a double cannot hold.
inline constexpr std::int64_t kTinyStart = 1403636584763555584;
/// Frame interval in ns.
inline constexpr std::int64_t kTinyStep = 49999872;

inline void write_tiny_euroc(const TemporaryFolder& folder, int pairs,
                             const std::string& end = "\n", const std::string& first_line = "") {
  for (int k = 0; k < 2; ++k) {
    const std::string camera = fmt::format("mav0/cam{}", k);
    std::string csv = "#timestamp [ns],filename" + end;
    for (int i = 0; i < pairs; ++i) {
      const std::int64_t stamp = kTinyStart + i * kTinyStep;
      csv += fmt::format("{0},{0}.png{1}", stamp, end);
      write_tiny_image(folder / fmt::format("{}/data/{}.png", camera, stamp), tiny_seed(i, k));
    }
    folder.write(camera + "/data.csv", csv);
    // The body's y axis is the camera's x axis: camera 1 sits half a metre along it.
    folder.write(camera + "/sensor.yaml", tiny_sensor_yaml(first_line, k == 0 ? 0.0 : 0.5, end));
  }
}

inline const char* tiny_calibration() {
  return "version: 1\n"
         "rig: {name: tiny, baseline: 0.5}\n"
         "cameras:\n"
         "  - {name: left, size: [70, 48], model: pinhole-radtan, intrinsics: [60, 60, 35, 24], "
         "distortion: [0, 0, 0, 0]}\n"
         "  - name: right\n"
         "    size: [70, 48]\n"
         "    model: pinhole-radtan\n"
         "    intrinsics: [60, 60, 35, 24]\n"
         "    distortion: [0, 0, 0, 0]\n"
         "    T_camera_left: [1, 0, 0, -0.5, 0, 1, 0, 0, 0, 0, 1, 0]\n";
}

inline std::string folder_name(int camera, int pair, const char* extension = "png") {
  return fmt::format("{}/{:03d}.{}", camera == 0 ? "left" : "right", pair, extension);
}

inline void write_tiny_folder(const TemporaryFolder& folder, int pairs,
                              const char* extension = "png") {
  std::string times;
  for (int i = 0; i < pairs; ++i) {
    times += fmt::format("{}\n", kTinyStart + i * kTinyStep);
    for (int k = 0; k < 2; ++k)
      write_tiny_image(folder / folder_name(k, i, extension), tiny_seed(i, k));
  }
  folder.write("times.txt", times);
  folder.write("calibration.yaml", tiny_calibration());
}

/// Keeps the first part of a file.
inline void truncate_file(const std::filesystem::path& file, double part) {
  std::filesystem::resize_file(
      file,
      static_cast<std::uintmax_t>(part * static_cast<double>(std::filesystem::file_size(file))));
}

}  // namespace vergence::test
