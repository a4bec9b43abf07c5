#pragma once
#include "core/calibration/options.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// Widens the joint covariance of a calibration by the random walk of `hours`. Pure.
void let_drift(double hours, const CalibrationOptions& options, RigCalibration* rig) noexcept;

/// Marks the transforms as unknown and keeps the intrinsics, because cameras may have been moved.
/// Pure.
void clear_transforms(RigCalibration* rig) noexcept;

}  // namespace vergence::calibration
