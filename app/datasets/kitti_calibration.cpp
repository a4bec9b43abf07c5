#include "app/datasets/kitti_calibration.hpp"

#include <algorithm>
#include <system_error>

#include "app/datasets/euroc_sensor.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kLargest = std::size_t{1} << 20U;  // bytes
constexpr int kWidest = 1 << 15;                         // px

}  // namespace

KittiCalibrationText::KittiCalibrationText(const std::filesystem::path& file, const char* without)
    : file_(file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored))
    refuse(file, 0, fmt::format("is missing: unpack the date's calibration there{}", without));
  text_ = read_text(file, kLargest);
  Lines lines(text_);
  for (std::string_view line; lines.next(&line);) {
    const std::size_t end = line.find_first_of(": \t");
    if (end == std::string_view::npos) continue;
    std::string_view rest = line.substr(end);
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
    if (rest.starts_with(':')) rest.remove_prefix(1);
    found_.insert_or_assign(line.substr(0, end), Line{rest, lines.number()});
  }
}

void KittiCalibrationText::read_numbers(const std::string& key, std::span<double> values) const {
  const auto found = found_.find(key);
  if (found == found_.end())
    refuse(file_, 0,
           fmt::format("has no line `{}:`, {} numbers are expected there", key, values.size()));
  std::array<std::string_view, 12> fields;
  const std::size_t count = split(found->second.rest, ' ', fields);
  if (count != values.size())
    refuse(file_, found->second.number,
           fmt::format("{}: has {} numbers where {} are expected", key, count, values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!parse_number(fields[i], &values[i]))
      refuse(file_, found->second.number,
             fmt::format("{}: `{}` is not a finite number", key, fields[i].substr(0, 40)));
}

Mat3 KittiCalibrationText::rotation(const std::string& key) const {
  const Mat3 written = matrix(key);
  Mat3 R;
  if (!accept_rotation(written, &R))
    refuse(file_, line_of(key), key + ": is no rotation, it is off orthonormal by more than 1e-4");
  return R;
}

Mat3 KittiCalibrationText::matrix(const std::string& key) const {
  std::array<double, 9> v{};
  read(key, &v);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
}

Vec3 KittiCalibrationText::vector(const std::string& key) const {
  std::array<double, 3> v{};
  read(key, &v);
  return {v[0], v[1], v[2]};
}

ImageSize KittiCalibrationText::size(const std::string& key) const {
  std::array<double, 2> v{};
  read(key, &v);
  if (!(v[0] >= 1 && v[0] <= kWidest && v[1] >= 1 && v[1] <= kWidest))
    refuse(file_, line_of(key), key + ": is no size of an image");
  return {static_cast<int>(v[0]), static_cast<int>(v[1])};
}

Intrinsics rectified_camera(const std::array<double, 12>& P, Vec3* t,
                            const std::filesystem::path& file, std::size_t line) {
  Intrinsics k;
  k.fx = P[0], k.fy = P[5], k.cx = P[2], k.cy = P[6];
  if (!(k.fx > 0 && k.fy > 0)) refuse(file, line, "has a focal length that is not positive");
  if (P[1] != 0 || P[4] != 0 || P[8] != 0 || P[9] != 0 || P[10] != 1)
    refuse(
        file, line,
        "is not the projection of a rectified camera: [fx 0 cx .; 0 fy cy .; 0 0 1 .] is expected");
  const double z = P[11];
  *t = {(P[3] - k.cx * z) / k.fx, (P[7] - k.cy * z) / k.fy, z};
  return k;
}

RigCalibration read_kitti_projections(const std::filesystem::path& file,
                                      const std::array<int, 2>& cameras) {
  const KittiCalibrationText text(file, ", or give a calibration with --calibration");
  RigCalibration rig;
  rig.cameras = 2;
  std::array<Vec3, 2> t;
  for (std::size_t k = 0; k < 2; ++k) {
    std::string name = fmt::format("P{}", cameras[k]);
    if (const std::string raw = fmt::format("P_rect_{:02d}", cameras[k]);
        !text.has(name) && text.has(raw))
      name = raw;
    std::array<double, 12> P{};
    text.read(name, &P);
    rig.intrinsics[k] = rectified_camera(P, &t[k], file, text.line_of(name));
  }
  rig.T_camera_left[1].t = t[1] - t[0];
  rig.baseline = rig.T_camera_left[1].t.norm();
  return rig;
}

}  // namespace vergence::app
