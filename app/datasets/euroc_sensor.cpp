#include "app/datasets/euroc_sensor.hpp"

#include <string>
#include <vector>

#include "app/config/yaml_file.hpp"
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

}  // namespace

bool accept_rotation(const Mat3& written, Mat3* R) noexcept {
  const double error = (written * written.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kOrthonormality) || !(written.determinant() > 0)) return false;
  *R = normalised(written);
  return true;
}

YAML::Node read_sensor_yaml(const std::filesystem::path& file) { return read_yaml(file).root(); }

Transform read_sensor_mount(const std::filesystem::path& file) {
  const YamlFile yaml = read_yaml(file);
  const YAML::Node mount = yaml.root()["T_BS"];
  if (!mount || !mount.IsMap() || !mount["data"])
    refuse(file, 0, "has no T_BS with `data`: give the sensor.yaml of the camera");
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

}  // namespace vergence::app
