#include <map>

#include <fmt/format.h>

#include "app/config/calibration_file.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/kitti_raw.hpp"
#include "app/datasets/euroc_sensor.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

constexpr std::size_t kLargest = std::size_t{1} << 20U;  // bytes
constexpr int kWidest = 1 << 15;                         // px

/// `KEY: numbers` lines of a calib_*.txt.
class CalibrationText {
 public:
  CalibrationText(const std::filesystem::path& file, const char* without) : file_(file) {
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored))
      refuse(file, 0, fmt::format("is missing: unpack the date's calibration there{}", without));
    text_ = read_text(file, kLargest);
    Lines lines(text_);
    for (std::string_view line; lines.next(&line);)
      if (const std::size_t colon = line.find(':'); colon != std::string_view::npos)
        found_.insert_or_assign(line.substr(0, colon),
                                Line{line.substr(colon + 1), lines.number()});
  }

  /// All of `values`. InputError: no such key, another count, no numbers.
  template <std::size_t N>
  void read(const std::string& key, std::array<double, N>* values) const {
    const auto found = found_.find(key);
    if (found == found_.end())
      refuse(file_, 0, fmt::format("has no line `{}:`, {} numbers are expected there", key, N));
    std::array<std::string_view, N> fields;
    const std::size_t count = split(found->second.rest, ' ', fields);
    if (count != N)
      refuse(file_, found->second.number,
             fmt::format("{}: has {} numbers where {} are expected", key, count, N));
    for (std::size_t i = 0; i < N; ++i)
      if (!parse_number(fields[i], &(*values)[i]))
        refuse(file_, found->second.number,
               fmt::format("{}: `{}` is not a finite number", key, fields[i].substr(0, 40)));
  }
  [[nodiscard]] Mat3 rotation(const std::string& key) const {
    const Mat3 written = matrix(key);
    Mat3 R;
    if (!accept_rotation(written, &R))
      refuse(file_, line_of(key),
             key + ": is no rotation, it is off orthonormal by more than 1e-4");
    return R;
  }
  [[nodiscard]] Mat3 matrix(const std::string& key) const {
    std::array<double, 9> v{};
    read(key, &v);
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
  }
  [[nodiscard]] Vec3 vector(const std::string& key) const {
    std::array<double, 3> v{};
    read(key, &v);
    return {v[0], v[1], v[2]};
  }
  [[nodiscard]] ImageSize size(const std::string& key) const {
    std::array<double, 2> v{};
    read(key, &v);
    if (!(v[0] >= 1 && v[0] <= kWidest && v[1] >= 1 && v[1] <= kWidest))
      refuse(file_, line_of(key), key + ": is no size of an image");
    return {static_cast<int>(v[0]), static_cast<int>(v[1])};
  }
  [[nodiscard]] std::size_t line_of(const std::string& key) const { return found_.at(key).number; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  struct Line {
    std::string_view rest;
    std::size_t number = 0;
  };
  std::filesystem::path file_;
  std::string text_;
  std::map<std::string_view, Line, std::less<>> found_;
};

std::string key(const char* name, int camera) { return fmt::format("{}_{:02d}", name, camera); }

Intrinsics raw_lens(const CalibrationText& text, int camera) {
  const Mat3 K = text.matrix(key("K", camera));
  std::array<double, 5> distortion{};  // k1 k2 p1 p2 k3
  text.read(key("D", camera), &distortion);
  Intrinsics lens;
  lens.fx = K(0, 0), lens.fy = K(1, 1), lens.cx = K(0, 2), lens.cy = K(1, 2);
  lens.distortion = distortion;
  if (!(lens.fx > 0 && lens.fy > 0) || K(0, 1) != 0 || K(1, 0) != 0 || K(2, 2) != 1)
    refuse(text.file(), text.line_of(key("K", camera)),
           key("K", camera) + ": is not [fx 0 cx; 0 fy cy; 0 0 1] with positive focal lengths");
  return lens;
}

/// Where a camera sits, from camera 00 before rectification, and how it sees.
struct Camera {
  Intrinsics lens{};
  Transform T_camera_camera0{};
};

Camera camera_of(const CalibrationText& text, int number, bool rectified) {
  Camera c;
  if (!rectified) {
    c.lens = raw_lens(text, number);
    c.T_camera_camera0 = {text.rotation(key("R", number)), text.vector(key("T", number))};
    return c;
  }
  const std::string name = key("P_rect", number);
  std::array<double, 12> P{};
  text.read(name, &P);
  c.lens = rectified_camera(P, &c.T_camera_camera0.t, text.file(), text.line_of(name));
  c.T_camera_camera0.R =
      text.rotation(key("R_rect", 0));  // all were turned into the axes of camera 00 as it became
  return c;
}

Transform rigid_of(const std::filesystem::path& file) {
  const CalibrationText text(
      file, ", or say by `--set ins.lever_arm_m=[…]` where the left camera sits in the INS's body");
  return {text.rotation("R"), text.vector("T")};
}

}  // namespace

KittiRawRig read_kitti_raw_rig(const std::filesystem::path& file, const std::array<int, 2>& cameras,
                               ImageSize images, const std::string& drive_name) {
  const CalibrationText text(file, ", or give one with --calibration");
  KittiRawRig out;
  const ImageSize raw = text.size(key("S", cameras[0])),
                  rectified = text.size(key("S_rect", cameras[0]));
  if (images != raw && images != rectified)
    refuse(file, text.line_of(key("S", cameras[0])),
           fmt::format("is for images of {}x{} pixels, or {}x{} rectified, but those of the drive "
                       "have {}x{}; use the calibration of its date",
                       raw.width, raw.height, rectified.width, rectified.height, images.width,
                       images.height));
  out.rectified = images == rectified && (images != raw || drive_name.ends_with("_sync"));
  std::array<Camera, 2> both;
  for (std::size_t k = 0; k < 2; ++k) {
    both[k] = camera_of(text, cameras[k], out.rectified);
    const ImageSize size = text.size(key(out.rectified ? "S_rect" : "S", cameras[k]));
    both[k].lens.width = size.width, both[k].lens.height = size.height;
  }
  out.T_left_camera0 = both[0].T_camera_camera0;
  out.rig.cameras = 2;
  out.rig.intrinsics = {both[0].lens, both[1].lens};
  out.rig.T_camera_left[1] = both[1].T_camera_camera0 * both[0].T_camera_camera0.inverse();
  if (out.rectified)
    out.rig.T_camera_left[1].R = Mat3::Identity();  // without the rounding of a product
  out.rig.baseline = out.rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&out.rig)) refuse(file, 0, bad->sentence);
  return out;
}

Transform read_kitti_raw_mount(const std::filesystem::path& folder) {
  return rigid_of(folder / "calib_velo_to_cam.txt") * rigid_of(folder / "calib_imu_to_velo.txt");
}

}  // namespace vergence::app::detail
