#pragma once
#include <string>

#include "app/recorder/records.hpp"

namespace vergence::app {

/// The line of calibrations.csv (kCalibrationsHeader) of camera k, 1 ≤ k < cameras, end of line
/// included.
///
/// Memory  None where the capacity of *line is enough.
void format_calibration(const CalibrationRecord& calibration, int k, std::string* line);

}  // namespace vergence::app
