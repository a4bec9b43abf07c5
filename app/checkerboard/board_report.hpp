#pragma once

#include <nlohmann/json_fwd.hpp>

#include "app/checkerboard/coverage.hpp"
#include "app/config/calibration_file.hpp"

/// Report of a target calibration.
namespace vergence::app {

struct BoardReport {
  const BoardCalibration& found;
  /// Names, and the rig as written.
  const CalibrationFile& file;
  const BoardPattern& board;
  const Coverage& coverage;
  /// In m.
  std::optional<double> measured_baseline{};
};

/// Text for a terminal: intrinsics and extrinsics with sigmas, rejected views, missing coverage.
[[nodiscard]] std::string format_report(const BoardReport& report);
/// Report as JSON; every key has its unit (docs/calibration.md).
[[nodiscard]] nlohmann::ordered_json json_report(const BoardReport& report);

}  // namespace vergence::app
