#pragma once
#include <optional>

#include <yaml-cpp/yaml.h>

#include "app/config/yaml_file.hpp"

/// Settings files of other programs: their syntax, and the names of the parts of a calibration in
/// them.
namespace vergence::app {

/// Parses the documents of a settings file as trees, in any syntax: YAML (OpenCV's header
/// `%YAML:1.0` and tabs are corrected), JSON, OpenCV's XML, `key = value` with sections, and the
/// ost.txt of camera_calibration. Skips empty documents. Throws InputError as YamlFile::parse()
/// does.
[[nodiscard]] std::vector<YamlFile> settings_trees(std::string text, const std::string& name);

/// Value of a file and its meaning.
///
/// Intrinsics: `matrix` is 3x3 or fx fy cx cy, `focal` one or two focal lengths, `centre` the
/// principal point, `k1` … `k6`, `p1`, `p2` one coefficient each, `fisheye` 0 or 1. Extrinsics:
/// `rectification` 3x3 and `projection` 3x4 as in ROS, `rotation` (3x3 or a rotation vector) and
/// `translation` of camera 1 from camera 0, `to_previous` X_camera = T X_previous camera,
/// `from_body` X_camera = T X_body, `to_body` X_body = T X_camera, `between` X_camera `index` = T
/// X_other camera, `focal_baseline` the focal length times the baseline. `file` names another file
/// with a camera's intrinsics. foreign_settings.cpp has the table.
struct Fact {
  std::string_view part{};
  /// 0 is left; empty if the key does not tell.
  std::optional<int> camera{};
  int index = 0;
  const YamlFile* file = nullptr;
  YAML::Node node{};
  /// Key in the file with its groups, such as `cam0.intrinsics`.
  std::string key{};
};

/// All values whose keys are in the vocabulary, in the order of the file. Keys are compared without
/// case and punctuation; a camera is identified by left and right, l and r, or a number (from 0 or
/// 1) in the key or an enclosing group.
[[nodiscard]] std::vector<Fact> find_facts(const YamlFile& file);

/// Program of a file, by a key that only its files have, and what is needed to read it, as a
/// message fragment. Empty if unknown. Sets *never if a program's files are not supported.
[[nodiscard]] std::string find_program(const YamlFile& file, bool* never);

}  // namespace vergence::app
