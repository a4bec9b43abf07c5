#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/estimator/estimator.hpp"

namespace vergence::app {

/// Session data that a replay needs before its first frame: JSON in a std_msgs/String at the
/// beginning of every file of a recording.
struct SessionDescription {
  static constexpr int kVersion = 1;
  static constexpr const char* kTopic = "/vergence/session";

  /// Version of the recording program.
  std::string program{};
  /// Content of calibration.yaml at the start of the run.
  std::string calibration{};
  /// Calibration that the plausibility gates compare with, in the same format.
  std::string nominal{};
  CalibrationTrust trust = CalibrationTrust::given;
  /// As in StartingCalibration.
  std::string cause{}, source{};
  Adoption adoption = Adoption::after_fixed_frames;
  /// True if INS samples are compared.
  bool ins = false;
  /// Origin of the INS extrinsics.
  std::string mount_source{};
  /// Settings that differ from the defaults, as KEY=VALUE.
  std::vector<std::string> settings{};
  /// Image topics by camera.
  std::vector<std::string> cameras{};
};

[[nodiscard]] std::string to_json(const SessionDescription& description);
/// Throws InputError, beginning with `name`, for invalid content or another version.
[[nodiscard]] SessionDescription parse_session_description(std::string_view json,
                                                           const std::string& name);

}  // namespace vergence::app
