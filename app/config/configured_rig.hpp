#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <yaml-cpp/node/node.h>

#include "app/config/yaml_file.hpp"
#include "core/types/calibration.hpp"

/// What a configuration says of its rig, as far as a calibration stands on it. The state file
/// (calibration_state.hpp) keeps it: a calibration found under other words is of another rig.
namespace vergence::app {

struct ConfiguredCamera {
  std::string serial_key{};  // cameras.N.serial; not in the file
  CameraModelKind model = CameraModelKind::pinhole_radtan;
  std::array<double, 2> offset{};  // px, of the region on the sensor
  std::array<double, 4> intrinsics{};
  std::array<double, 5> distortion{};
  std::array<double, 12> T_camera_left{};  // rows of [R t]

  /// The lens and the place that the estimator would be given.
  [[nodiscard]] static ConfiguredCamera of(const Intrinsics& lens, const Transform& place);
};

struct ConfiguredRig {
  double baseline = 0;  // m
  std::vector<ConfiguredCamera> cameras{};
};

/// The block `configured:`, the last of the file.
[[nodiscard]] std::string format_configured(const ConfiguredRig& rig);
/// Errors  InputError with file:line.
[[nodiscard]] ConfiguredRig read_configured(const YamlFile& file, const YAML::Node& node);

/// The first thing that the configuration says otherwise now, as the end of a sentence; empty:
/// nothing.
[[nodiscard]] std::string find_change(const ConfiguredRig& then, const ConfiguredRig& now);

}  // namespace vergence::app
