#pragma once
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "app/checkerboard/board_calibration.hpp"
#include "app/checkerboard/coverage.hpp"
#include "app/config/calibration_file.hpp"

/// Report of a target calibration.
namespace vergence::app {

struct BoardReport {
  const BoardCalibration& found;
  const CalibrationFile& file;  // names, and the rig as it is written
  const BoardPattern& board;
  const Coverage& coverage;
  std::optional<double> measured_baseline{};  // m
};

/// Tables for a terminal: lenses, places with their sigmas, views refused, missing coverage.
[[nodiscard]] std::string format_report(const BoardReport& report);
/// Formats the report as JSON; every key has its unit. docs/calibration.md.
[[nodiscard]] nlohmann::ordered_json json_report(const BoardReport& report);

}  // namespace vergence::app
