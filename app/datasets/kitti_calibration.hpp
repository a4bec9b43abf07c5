#pragma once
#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "app/datasets/image_file.hpp"
#include "app/datasets/text_file.hpp"
#include "core/math/types.hpp"
#include "core/types/calibration.hpp"

/// KITTI's calib.txt and calib_*.txt.
namespace vergence::app {

/// The lines `KEY: numbers` of such a file; copies of it may lack the colon.
class KittiCalibrationText {
 public:
  /// `without`: what a sentence about a missing file goes on with. InputError: no such file.
  KittiCalibrationText(const std::filesystem::path& file, const char* without);

  [[nodiscard]] bool has(const std::string& key) const { return found_.contains(key); }
  // InputError with file:line: no such key, another count, no numbers, no rotation, no size.
  template <std::size_t N>
  void read(const std::string& key, std::array<double, N>* values) const {
    read_numbers(key, *values);
  }
  [[nodiscard]] Mat3 rotation(const std::string& key) const;
  [[nodiscard]] Mat3 matrix(const std::string& key) const;
  [[nodiscard]] Vec3 vector(const std::string& key) const;
  [[nodiscard]] ImageSize size(const std::string& key) const;
  [[nodiscard]] std::size_t line_of(const std::string& key) const { return found_.at(key).number; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  struct Line {
    std::string_view rest;
    std::size_t number = 0;
  };
  void read_numbers(const std::string& key, std::span<double> values) const;

  std::filesystem::path file_;
  std::string text_;
  std::map<std::string_view, Line, std::less<>> found_;
};

/// The camera that a rectified projection P = K [I | t] (3×4 row by row, pixels and metres)
/// describes, without its image's size, and where it sits: X_k = X_rectified + *t. InputError with
/// file:line: it is no such projection.
[[nodiscard]] Intrinsics rectified_camera(const std::array<double, 12>& P, Vec3* t,
                                          const std::filesystem::path& file, std::size_t line);

/// The rig of two rectified cameras by their projections, `P0` or `P_rect_00`, without the images'
/// sizes.
[[nodiscard]] RigCalibration read_kitti_projections(const std::filesystem::path& file,
                                                    const std::array<int, 2>& cameras);

}  // namespace vergence::app
