#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "app/config/yaml_file.hpp"

/// Names of the parts of a calibration in other programs.
namespace vergence::app {

/// A value of a file, with what it is of.
///
/// Parts of a lens: `matrix` is 3x3 or fx fy cx cy, `focal` one number for both directions or two,
/// `centre` the principal point, `k1` … `k6`, `p1`, `p2` one coefficient each,
/// `fisheye` 0 or 1. Of where a camera sits: `rectification` 3x3 and `projection` 3x4 as ROS has
/// them, `rotation` (3x3 or a rotation vector) and `translation` of camera 1 from camera 0,
/// `to_previous` X_camera = T X_camera before, `from_body` X_camera = T X_body, `to_body` X_body =
/// T X_camera, `between` X_camera `index` = T X_camera of the other, `focal_baseline` the focal
/// length times the baseline. `file` names another file with the lens of a camera. The table of
/// vocabulary.cpp has them all.
struct Fact {
  std::string_view part{};
  std::optional<int> camera{};  // 0 is left; nothing: the key does not say
  int index = 0;
  const YamlFile* file = nullptr;
  YAML::Node node{};
  std::string key{};  // as it stands in the file, groups before it: `cam0.intrinsics`
};

/// All values whose keys are in the vocabulary, in the order of the file. Keys are compared without
/// capitals and signs; a camera is told by the words left and right, l and r, or a number (from 0
/// or from 1) in the key or a group around it.
[[nodiscard]] std::vector<Fact> find_facts(const YamlFile& file);

/// The program that a file is of, by a key that only its files have, and what it needs to be read:
/// half a message. Empty: none that is known. *never is set where a program's files are never
/// read.
[[nodiscard]] std::string find_program(const YamlFile& file, bool* never);

}  // namespace vergence::app
