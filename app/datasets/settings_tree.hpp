#pragma once
#include <string>
#include <vector>

#include "app/config/yaml_file.hpp"

namespace vergence::app {

/// Parses the documents of a settings file as trees, in any syntax: YAML (OpenCV's header
/// `%YAML:1.0` and tabs are corrected), JSON, OpenCV's XML, `key = value` with sections, and the
/// ost.txt of camera_calibration. Skips empty documents. Throws InputError as YamlFile::parse()
/// does.
[[nodiscard]] std::vector<YamlFile> settings_trees(std::string text, const std::string& name);

}  // namespace vergence::app
