#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/odometry/options.hpp"

namespace vergence::app {

/// `rig:` of the configuration.
struct RigSettings {
  std::string name{};  // of the rig, in the calibration.yaml that a session writes
};

/// Everything a user may change, with its defaults. Each member is bound to a row of the schema (app/config/schema.hpp),
/// which is where its unit, range and meaning stand.
struct Configuration {
  RigSettings rig{};
  OdometryOptions odometry{};
  int threads = 2;  // 1: both images on the estimator's thread
};

/// Defaults, then the YAML file if one is given, then the `--set` arguments `KEY=VALUE` in order; the last one wins.
///
/// KEY is dotted, with numbers for list items; VALUE is YAML (`0.4`, `text`, `[1, 2]`).
/// Errors  InputError with file:line (or the --set argument): unreadable file, unknown key (with the nearest known one),
///         a key that stands twice, wrong type, outside the range, values that contradict each other.
[[nodiscard]] Configuration load_configuration(const std::optional<std::filesystem::path>& file, const std::vector<std::string>& set);

/// The same from text; `name` stands for the file in error messages.
[[nodiscard]] Configuration parse_configuration(std::string_view yaml, const std::string& name, const std::vector<std::string>& set);

/// Every key and its value, one `key=value` a line, ordered by key, numbers in the shortest form that reads back the same.
[[nodiscard]] std::string canonical_text(const Configuration& configuration);

/// 16 hexadecimal digits (FNV-1a, 64 bit) of canonical_text(): equal for equal configurations, however they were written.
[[nodiscard]] std::string configuration_hash(const Configuration& configuration);

}  // namespace vergence::app
