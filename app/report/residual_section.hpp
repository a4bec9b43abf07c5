#pragma once
#include <string>

#include "app/report/session.hpp"

namespace vergence::app::report {

/// The fields of residuals.csv, side by side: one figure a camera and calibration, one scale a
/// camera. Empty without the file.
[[nodiscard]] std::string residual_section(const Session& session);

}  // namespace vergence::app::report
