#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/estimator/estimator.hpp"

namespace vergence::app {

/// Session data that a replay needs before its first frame: at the beginning of every file
/// of a recording, JSON in a std_msgs/String.
struct SessionDescription {
  static constexpr int kVersion = 1;
  static constexpr const char* kTopic = "/vergence/session";

  std::string program{};      // version of the program that recorded
  std::string calibration{};  // calibration.yaml of what the drive began with
  std::string nominal{};      // the same of what its gates compare with
  CalibrationTrust trust = CalibrationTrust::given;
  std::string cause{}, source{};  // as StartingCalibration has them
  Adoption adoption = Adoption::after_fixed_frames;
  bool ins = false;                     // readings are compared
  std::string mount_source{};           // where the mount of the INS is from
  std::vector<std::string> settings{};  // KEY=VALUE where they are not the defaults
  std::vector<std::string> cameras{};   // topics of their images
};

[[nodiscard]] std::string to_json(const SessionDescription& description);
/// InputError, beginning with `name`: it is none, or of another version.
[[nodiscard]] SessionDescription parse_session_description(std::string_view json,
                                                           const std::string& name);

}  // namespace vergence::app
