#include <algorithm>
#include <sstream>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "app/foreign_calibration/foreign_formats.hpp"
#include "app/foreign_calibration/yaml_matrix.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

/// What stands before the image, which cameras of a rig do not share: `/stereo/left/image_raw` →
/// `left`; where no part is called an image, the last one. Empty: nothing stands there.
std::string name_in(const std::string& topic) {
  std::string name;
  std::istringstream parts(topic);
  for (std::string part; std::getline(parts, part, '/');) {
    if (part.starts_with("image")) return name;
    if (!part.empty()) name = part;
  }
  return name;
}

Intrinsics read_lens(const YamlFile& file, const YAML::Node& camera, const std::string& name) {
  const auto field = [&name](const char* key) { return name + "." + key; };
  const YAML::Node model = need(file, camera, "camera_model", field("camera_model"));
  if (const std::string word = file.text(model, field("camera_model")); word != "pinhole")
    file.fail(model, fmt::format("{} is \"{}\"; this program has pinhole lenses (Kalibr's "
                                 "pinhole-radtan and pinhole-equi)",
                                 field("camera_model"), word.substr(0, 60)));
  Intrinsics lens;
  const YAML::Node size = need(file, camera, "resolution", field("resolution"));
  if (!size.IsSequence() || size.size() != 2)
    file.fail(size, field("resolution") + " is not [width, height]");
  lens.width = read_side(file, size[0], field("resolution"));
  lens.height = read_side(file, size[1], field("resolution"));
  const auto f = file.numbers(need(file, camera, "intrinsics", field("intrinsics")),
                              field("intrinsics"), 4, 4);
  lens.fx = f[0], lens.fy = f[1], lens.cx = f[2], lens.cy = f[3];
  const YAML::Node distortion = need(file, camera, "distortion_model", field("distortion_model"));
  const std::string word = file.text(distortion, field("distortion_model"));
  if (word == "none") return lens;
  if (word != "radtan" && word != "equidistant")
    file.fail(distortion, fmt::format("{} is \"{}\"; radtan, equidistant and none are known",
                                      field("distortion_model"), word.substr(0, 60)));
  if (word == "equidistant") lens.kind = CameraModelKind::pinhole_equidistant;
  const auto d = file.numbers(need(file, camera, "distortion_coeffs", field("distortion_coeffs")),
                              field("distortion_coeffs"), 4, 4);
  std::copy(d.begin(), d.end(), lens.distortion.begin());
  return lens;
}

Transform read_step(const YamlFile& file, const YAML::Node& camera, const std::string& name) {
  const std::string field = name + ".T_cn_cnm1";
  const YAML::Node node = need(file, camera, "T_cn_cnm1", field);
  const auto n = read_matrix(file, node, field, 4, 4);
  if (n[12] != 0 || n[13] != 0 || n[14] != 0 || n[15] != 1)
    file.fail(node, field + " does not end with the row 0 0 0 1");
  Transform T;
  T.R << n[0], n[1], n[2], n[4], n[5], n[6], n[8], n[9], n[10];
  T.t << n[3], n[7], n[11];
  return T;
}

}  // namespace

CalibrationFile read_kalibr(const YamlFile& file, Remarks* remarks) {
  CalibrationFile calibration;
  RigCalibration& rig = calibration.rig;
  bool of_imu = false;
  std::size_t cameras = 0;
  if (!file.root().IsMap()) file.fail(file.root(), "is not a group of keys (cam0, cam1, …)");
  for (;; ++cameras) {
    const std::string name = fmt::format("cam{}", cameras);
    const YAML::Node& root = file.root();
    const YAML::Node camera = root[name];
    if (!camera) break;
    if (cameras == kMaxCameras)
      file.fail(camera,
                fmt::format("{} is one too many; a rig has up to {} cameras", name, kMaxCameras));
    if (!camera.IsMap()) file.fail(camera, name + " is not a group of keys");
    rig.intrinsics[cameras] = read_lens(file, camera, name);
    if (cameras > 0)
      rig.T_camera_left[cameras] = read_step(file, camera, name) * rig.T_camera_left[cameras - 1];
    if (const YAML::Node topic = camera["rostopic"])
      if (const std::string own = name_in(file.text(topic, name + ".rostopic")); !own.empty())
        calibration.names[cameras] = own;
    of_imu = of_imu || camera["T_cam_imu"] || camera["timeshift_cam_imu"];
  }
  if (cameras < 2)
    file.fail(file.root(), fmt::format("has {} cameras (cam0, cam1, …); a rig has 2 to {}", cameras,
                                       kMaxCameras));
  rig.cameras = static_cast<int>(cameras);
  detail::check_read(file.name(), &calibration);
  if (of_imu)
    remarks->push_back(
        file.name() +
        ": T_cam_imu and timeshift_cam_imu are left out; comparison and ins have keys for an INS");
  return calibration;
}

std::string format_kalibr(const CalibrationFile& calibration, Remarks* remarks) {
  const RigCalibration& rig = calibration.rig;
  std::string text;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
    if (radtan && lens.distortion[4] != 0)
      throw InputError(
          fmt::format("cameras.{}.distortion has k3 = {}; Kalibr's radtan has four coefficients, "
                      "calibrate without --k3",
                      k, lens.distortion[4]));
    text += fmt::format("cam{}:\n", k);
    if (k > 0) {
      const Transform T = rig.T_camera_left[k] * rig.T_camera_left[k - 1].inverse();
      text += "  T_cn_cnm1:\n";
      for (int row = 0; row < 3; ++row)
        text += "  - " + number_list(std::array{T.R(row, 0), T.R(row, 1), T.R(row, 2), T.t(row)}) +
                "\n";
      text += "  - [0.0, 0.0, 0.0, 1.0]\n";
    }
    std::vector<int> others;
    for (int other = 0; other < rig.cameras; ++other)
      if (other != static_cast<int>(k)) others.push_back(other);
    text += fmt::format("  cam_overlaps: [{}]\n  camera_model: pinhole\n", fmt::join(others, ", "));
    text += "  distortion_coeffs: " + number_list(std::span(lens.distortion).first(4)) + "\n";
    text += fmt::format("  distortion_model: {}\n", radtan ? "radtan" : "equidistant");
    text += "  intrinsics: " + number_list(std::array{lens.fx, lens.fy, lens.cx, lens.cy}) + "\n";
    text += fmt::format("  resolution: [{}, {}]\n", lens.width, lens.height);
    std::string name = calibration.names[k];
    std::replace(name.begin(), name.end(), '/', '_');
    text += "  rostopic: " + double_quoted("/" + name + "/image_raw") + "\n";
  }
  detail::remark_lost(calibration, "a camchain", false, remarks);
  return text;
}

}  // namespace vergence::app
