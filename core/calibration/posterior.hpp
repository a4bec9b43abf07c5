#pragma once
#include "core/calibration/options.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// What is known of a rig grows old: a random walk of `hours` is added to its joint covariance
/// (METHOD §6.1). Threads pure.
void let_drift(double hours, const CalibrationOptions& options, RigCalibration* rig) noexcept;

/// The cameras may sit elsewhere than they did, the lenses are the same: of the transforms nothing
/// is known any more. Threads pure.
void clear_transforms(RigCalibration* rig) noexcept;

}  // namespace vergence::calibration
