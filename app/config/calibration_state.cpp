#include "app/config/calibration_state.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <system_error>

#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr const char* kFileName = "calibration_state.yaml";
// Keys that a calibration depends on begin so, or are those of a camera that end so.
constexpr std::array<std::string_view, 3> kOfRig{"rig.nominal.", "mock.intrinsics_error.",
                                                 "mock.calibration_error."};
constexpr std::array<std::string_view, 5> kOfCamera{".model", ".offset.", ".intrinsics.",
                                                    ".distortion.", ".T_camera_left."};

std::string folder_name(const std::string& rig_name) {
  std::string name = rig_name.empty() ? "rig" : rig_name;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_' && c != '.')
      c = '_';
  if (name.front() == '.') name.front() = '_';
  return name;
}

/// Why a calibration was found under another configuration; empty: it was not.
std::string other_configuration(const CalibrationFile& found, const CalibrationFile& expected) {
  if (!found.configured) return "the configuration it was found with is not recorded";
  const auto value = [](const CalibrationFile& file, const std::string& key) {
    const auto at = file.configured->find(key);
    return at == file.configured->end() ? "its default" : at->second;
  };
  for (const CalibrationFile* file : {&found, &expected})
    for (const auto& [key, ignored] : *file->configured)
      if (value(found, key) != value(expected, key))
        return fmt::format("{} was {} when it was saved and is now {}", key, value(found, key),
                           value(expected, key));
  // Differs after a drive with --calibration. Images do not show which length is right.
  const double found_m = found.rig.baseline, expected_m = expected.rig.baseline;
  if (std::abs(found_m - expected_m) >= kOtherLength * expected_m)
    return fmt::format("its baseline is {:g} m, the configuration's {:g} m", found_m, expected_m);
  return "";
}

/// Why a calibration is not of this rig; empty: it is.
std::string mismatch(const CalibrationFile& found, const CalibrationFile& expected) {
  if (std::string other = other_images(found.rig, expected.rig); !other.empty()) return other;
  for (std::size_t k = 0; k < static_cast<std::size_t>(found.rig.cameras); ++k)
    if (found.serials[k] != expected.serials[k])
      return fmt::format("its camera {} has the serial \"{}\", the connected one \"{}\"", k,
                         found.serials[k], expected.serials[k]);
  return other_configuration(found, expected);
}

}  // namespace

std::string other_images(const RigCalibration& found, const RigCalibration& expected) {
  if (found.cameras != expected.cameras)
    return fmt::format("it has {} cameras, the configuration {}", found.cameras, expected.cameras);
  for (std::size_t k = 0; k < static_cast<std::size_t>(found.cameras); ++k) {
    const Intrinsics &x = found.intrinsics[k], &y = expected.intrinsics[k];
    if (x.width != y.width || x.height != y.height)
      return fmt::format("its camera {0} has {1} x {2} pixels, but cameras.{0}.size is {3} x {4}",
                         k, x.width, x.height, y.width, y.height);
  }
  return "";
}

std::map<std::string, std::string> configured_rig(const Configuration& configuration) {
  std::map<std::string, std::string> values;
  for (const auto& setting : changed_settings(configuration)) {
    const std::string& key = setting.first;
    const auto begins = [&key](std::string_view part) { return key.starts_with(part); };
    const auto has = [&key](std::string_view part) {
      return key.starts_with("cameras.") && key.find(part) != std::string::npos;
    };
    if (std::ranges::any_of(kOfRig, begins) || std::ranges::any_of(kOfCamera, has))
      values.insert(setting);
  }
  return values;
}

std::optional<std::filesystem::path> state_file(const RigSettings& rig) {
  if (rig.state_dir == "none") return std::nullopt;
  if (!rig.state_dir.empty()) return std::filesystem::path(rig.state_dir) / kFileName;
  for (const auto& [variable, below] : {std::pair{"XDG_STATE_HOME", ""}, {"HOME", ".local/state"}})
    // The XDG rules require absolute paths.
    if (const char* folder = std::getenv(variable); folder != nullptr && folder[0] == '/')
      return std::filesystem::path(folder) / below / "vergence" / folder_name(rig.name) / kFileName;
  return std::nullopt;
}

CalibrationState read_state(const std::filesystem::path& file, const CalibrationFile& expected) {
  CalibrationState state;
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    if (error)
      state.message = file.string() + ": cannot be accessed (" + error.message() +
                      "); the run starts without it";
    return state;
  }
  try {
    CalibrationFile found = read_calibration(file);
    if (const std::string why = mismatch(found, expected); !why.empty())
      state.message = file.string() + ": is not used: " + why;
    else
      state.calibration = std::move(found);
  } catch (const InputError& e) {
    state.message = std::string(e.what()) + "; the run starts without it";
  }
  return state;
}

void write_state(const std::filesystem::path& file, const CalibrationFile& calibration) {
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  if (error)
    throw InputError(file.parent_path().string() + ": cannot be created (" + error.message() +
                     "); set rig.state_dir to a writable directory, or to none");
  std::string text = format_calibration(calibration);
  if (calibration.configured) {
    text += "configured:  # keys that differed from their defaults when it was estimated\n";
    for (const auto& [key, value] : *calibration.configured)
      text += fmt::format("  {}: {}\n", key, value);
    if (calibration.configured->empty()) text += "  {}\n";
  }
  replace_durably(file, text);
}

}  // namespace vergence::app
