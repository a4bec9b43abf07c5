#pragma once
#include <string>
#include <vector>

#include "app/config/yaml_file.hpp"

namespace vergence::app {

/// The documents of a settings file as trees, whatever its syntax: YAML (OpenCV's head `%YAML:1.0`
/// and tabs are put right), JSON, OpenCV's XML, `key = value` with sections, and the ost.txt of
/// camera_calibration. Empty documents are none. InputError as YamlFile::parse().
[[nodiscard]] std::vector<YamlFile> settings_trees(std::string text, const std::string& name);

}  // namespace vergence::app
