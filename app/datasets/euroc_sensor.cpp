#include "app/datasets/euroc_sensor.hpp"

#include <string>

#include "app/datasets/text_file.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kLargestYaml = 1U << 20U;  // bytes; a sensor.yaml has one or two thousand
// Between seven digits (1.5e-7 in KITTI's poses) and a matrix that is no rotation (1e-3 would bend a kilometre by a metre).
constexpr double kOrthonormality = 1e-4;

std::size_t line_of(const YAML::Mark& mark) { return mark.line < 0 ? 0 : static_cast<std::size_t>(mark.line) + 1; }

}  // namespace

bool accept_rotation(const Mat3& written, Mat3* R) noexcept {
  const double error = (written * written.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kOrthonormality) || !(written.determinant() > 0)) return false;
  *R = normalised(written);
  return true;
}

YAML::Node read_sensor_yaml(const std::filesystem::path& file) {
  std::string text = read_text(file, kLargestYaml);
  if (text.starts_with("%YAML:")) text[0] = '#';  // a comment in its place keeps the line numbers
  try {
    YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) refuse(file, 0, "is not a sensor.yaml: there are no keys in it");
    return root;
  } catch (const YAML::Exception& e) {
    refuse(file, line_of(e.mark), "is not YAML: " + e.msg);
  }
}

Transform read_T_body_sensor(const std::filesystem::path& file) {
  const YAML::Node root = read_sensor_yaml(file);
  try {
    const YAML::Node T_BS = root["T_BS"];
    if (!T_BS || !T_BS.IsMap()) refuse(file, 0, "has no T_BS: give the sensor.yaml of the camera");
    const YAML::Node data = T_BS["data"];
    const std::size_t line = line_of(T_BS.Mark());
    if (!data || !data.IsSequence() || data.size() != 16) refuse(file, line, "T_BS needs `data` with 16 numbers, a 4x4 matrix row by row");
    Eigen::Matrix4d M;
    for (int i = 0; i < 16; ++i) M(i / 4, i % 4) = data[i].as<double>();
    Transform T;
    const bool homogeneous = (M.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() <= kOrthonormality;
    if (!M.allFinite() || !homogeneous || !accept_rotation(M.topLeftCorner<3, 3>(), &T.R))
      refuse(file, line,
             "T_BS is not a rigid transform: its rotation is off orthonormal by more than 1e-4, or its last row is not 0 0 0 1");
    T.t = M.topRightCorner<3, 1>();
    return T;
  } catch (const YAML::Exception& e) {
    refuse(file, line_of(e.mark), "T_BS cannot be read: " + e.msg);
  }
}

}  // namespace vergence::app
