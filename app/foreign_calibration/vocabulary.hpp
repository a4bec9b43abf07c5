#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "app/config/yaml_file.hpp"

/// What programs call the parts of a calibration.
namespace vergence::app {

/// Of a lens: `matrix` is 3x3 or fx fy cx cy, `focal` one number for both directions or two,
/// `centre` the principal point, `coefficient` one of k1 … k6, p1, p2 (`index` is its place there),
/// `fisheye` 0 or 1. Of where a camera sits: `rectification` 3x3 and `projection` 3x4 as ROS has
/// them, `rotation` (3x3 or a rotation vector) and `translation` of camera 1 from camera 0,
/// `to_previous` X_camera = T X_camera before, `from_body` X_camera = T X_body, `to_body` X_body =
/// T X_camera, `between` X_camera `index` = T X_camera `other`, `focal_baseline` the focal length
/// times the baseline. `file` names another file with the lens of a camera, `other` is known and
/// not used.
enum class Part : std::uint8_t {
  matrix,
  fx,
  fy,
  cx,
  cy,
  focal,
  centre,
  distortion,
  coefficient,
  camera_model,
  distortion_model,
  fisheye,
  size,
  width,
  height,
  rectification,
  projection,
  rotation,
  translation,
  to_previous,
  from_body,
  to_body,
  between,
  baseline,
  focal_baseline,
  binning_x,
  binning_y,
  roi_x,
  roi_y,
  roi_width,
  roi_height,
  topic,
  name,
  file,
  other
};

/// A value of a file, with what it is of.
struct Fact {
  Part part{};
  std::optional<int> camera{};  // 0 is left; nothing: the key does not say
  int index = 0, other = 0;
  const YamlFile* file = nullptr;
  YAML::Node node{};
  std::string key{};  // as it stands in the file, groups before it: `cam0.intrinsics`
};

/// All values whose keys are in the vocabulary, in the order of the file. Keys are compared without
/// capitals and signs; a camera is told by the words left and right, l and r, or a number (from 0
/// or from 1) in the key or a group around it.
[[nodiscard]] std::vector<Fact> facts_of(const YamlFile& file);

/// The program that a file is of, by a key that only its files have, and what to do where the file
/// cannot be used: half a sentence. Empty: none that is known. *never is set where a program's
/// files are never read.
[[nodiscard]] std::string program_of(const YamlFile& file, bool* never);

}  // namespace vergence::app
