#include "app/datasets/euroc_sensor.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "app/config/yaml_file.hpp"
#include "app/datasets/ros_camera.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app {
namespace {

// Between seven digits (1.5e-7 in KITTI's poses) and a matrix that is no rotation (1e-3 would bend
// a kilometre by a metre).
constexpr double kOrthonormality = 1e-4;

YamlFile read_yaml(const std::filesystem::path& file) {
  std::string text = read_text(file, kLargestYaml);
  if (text.starts_with("%YAML:")) text[0] = '#';  // a comment in its place keeps the line numbers
  YamlFile yaml = YamlFile::parse(text, file.string());
  if (!yaml.root().IsMap()) refuse(file, 0, "is not a sensor.yaml: there are no keys in it");
  return yaml;
}

Transform read_mount(const YamlFile& yaml) {
  const YAML::Node mount = yaml.root()["T_BS"];
  if (!mount || !mount.IsMap() || !mount["data"])
    refuse(yaml.name(), 0, "has no T_BS with `data`: give the sensor.yaml of the camera");
  const YAML::Node data = mount["data"];
  const std::vector<double> v = yaml.numbers(data, "T_BS data, a 4x4 matrix row by row,", 16, 16);
  Transform T;
  Mat3 written;
  written << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
  const bool homogeneous = v[12] == 0 && v[13] == 0 && v[14] == 0 && v[15] == 1;
  if (!homogeneous || !accept_rotation(written, &T.R))
    yaml.fail(data,
              "T_BS is not a rigid transform: its rotation is off orthonormal by more than 1e-4, "
              "or its last row is not 0 0 0 1");
  T.t = {v[3], v[7], v[11]};
  return T;
}

/// Lens and size of a camera's sensor.yaml.
Intrinsics read_intrinsics(const YamlFile& yaml) {
  const auto value = [&](const char* key) {
    const YAML::Node node = yaml.root()[key];
    if (!node) refuse(yaml.name(), 0, std::string("has no ") + key);
    return node;
  };
  const auto numbers = [&](const char* key, std::size_t least, std::size_t most) {
    return yaml.numbers(value(key), key, least, most);
  };
  const auto word = [&](const char* key) { return yaml.text(value(key), key); };
  const auto model = word("distortion_model");
  const auto kind = lens_model(model);
  if (const auto camera = word("camera_model"); camera != "pinhole" || !kind)
    refuse(yaml.name(), 0,
           "camera_model is " + camera + " and distortion_model " + model +
               "; pinhole with radial-tangential or equidistant is what can be read");
  Intrinsics k;
  k.kind = *kind;
  const auto size = numbers("resolution", 2, 2), f = numbers("intrinsics", 4, 4);
  const auto d =
      numbers("distortion_coefficients", 4, k.kind == CameraModelKind::pinhole_radtan ? 5 : 4);
  constexpr double kLargestSide = 1 << 15;  // px
  for (const double side : size)
    if (!(side >= 1 && side <= kLargestSide))
      refuse(yaml.name(), 0, "resolution is no size of an image");
  k.width = static_cast<int>(size[0]), k.height = static_cast<int>(size[1]);
  k.fx = f[0], k.fy = f[1], k.cx = f[2], k.cy = f[3];
  std::copy(d.begin(), d.end(), k.distortion.begin());
  return k;
}

}  // namespace

bool accept_rotation(const Mat3& written, Mat3* R) noexcept {
  const double error = (written * written.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kOrthonormality) || !(written.determinant() > 0)) return false;
  *R = normalised(written);
  return true;
}

Transform read_sensor_mount(const std::filesystem::path& file) {
  return read_mount(read_yaml(file));
}

RigCalibration read_sensor_rig(const std::filesystem::path& left,
                               const std::filesystem::path& right) {
  const YamlFile of_left = read_yaml(left), of_right = read_yaml(right);
  RigCalibration rig;
  rig.cameras = 2;
  rig.intrinsics = {read_intrinsics(of_left), read_intrinsics(of_right)};
  rig.T_camera_left[1] = read_mount(of_right).inverse() * read_mount(of_left);
  rig.T_camera_left[1].R = normalised(rig.T_camera_left[1].R);
  rig.baseline = rig.T_camera_left[1].t.norm();
  return rig;
}

}  // namespace vergence::app
